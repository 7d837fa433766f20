#include "node/publish/clock_answer.h"

#include "lib/clock/wall_clock.h"
#include "lib/log/log.h"
#include "lib/wire/wire.h"

namespace imprint {
namespace {

constexpr std::size_t kMaxQuestions = 16;

}  // namespace

ClockAnswer::ClockAnswer()
    : questions_(std::make_shared<BoundedQueue<Question>>(kMaxQuestions)),
      offset_ns_(std::make_shared<std::atomic<std::int64_t>>(0)) {}

Result<std::unique_ptr<ClockAnswer>> ClockAnswer::start(Transport& transport, const Keys& keys,
                                                        const std::string& camera_id) {
  std::unique_ptr<ClockAnswer> answer(new ClockAnswer);
  auto declared = transport.answer(keys.service(camera_id, "clock"),
                                   [questions = answer->questions_](std::shared_ptr<Query> query) {
                                     questions->push({std::move(query), wall_clock_ns()});
                                   });
  if (!declared) return pass_on(declared.error());
  answer->declaration_ = std::move(*declared);
  answer->worker_ = std::thread([self = answer.get()] { self->work(); });
  return answer;
}

ClockAnswer::~ClockAnswer() {
  declaration_.reset();
  questions_->drop();
  if (worker_.joinable()) worker_.join();
}

void ClockAnswer::work() {
  while (const auto question = questions_->pop()) {
    const auto asked = decode_clock_question(question->query->payload());
    if (!asked) {
      spdlog::debug("{}", asked.error().message);
      continue;
    }
    if (asked->offset_ns) *offset_ns_ = *asked->offset_ns;
    const auto replied = question->query->reply(encode_clock_reading({question->received_ns, wall_clock_ns()}));
    if (!replied) spdlog::debug("{}", replied.error().message);
  }
}

}  // namespace imprint
