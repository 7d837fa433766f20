#include "tests/fuzz/fuzz.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iostream>
#include <iterator>
#include <random>

namespace imprint {
namespace {

constexpr unsigned kHangs_s = 10;
constexpr std::size_t kMaxBytes = 64 * 1024;
constexpr int kMaxChanges = 8;
constexpr std::size_t kMaxPool = 512;

// For the signal handler: what was being taken, and where to put it.
const std::string* current = nullptr;
char finding[256];

void keep_finding(int signal_number) {
  const int file = ::open(finding, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (file >= 0 && current != nullptr) {
    [[maybe_unused]] const auto written = ::write(file, current->data(), current->size());
    ::close(file);
  }
  ::signal(signal_number, SIG_DFL);
  ::raise(signal_number);
}

void watch_for_findings(const std::string& name) {
  std::snprintf(finding, sizeof finding, "finding-%s", name.c_str());
  for (const int signal_number : {SIGSEGV, SIGABRT, SIGBUS, SIGFPE, SIGILL, SIGALRM})
    ::signal(signal_number, keep_finding);
}

class Mutator {
 public:
  explicit Mutator(std::uint64_t seed) : random_(seed) {}

  std::string next(const std::vector<std::string>& pool) {
    std::string input = pool[below(pool.size())];
    for (int changes = 1 + static_cast<int>(below(kMaxChanges)); changes > 0; --changes) change(input, pool);
    if (input.size() > kMaxBytes) input.resize(kMaxBytes);
    return input;
  }

  std::size_t below(std::size_t limit) { return limit == 0 ? 0 : random_() % limit; }

 private:
  void change(std::string& input, const std::vector<std::string>& pool) {
    static const std::vector<std::string> kOdd = {"-1",
                                                  "0",
                                                  "1e309",
                                                  "nan",
                                                  "-inf",
                                                  "99999999999999999999",
                                                  "2147483648",
                                                  "\"",
                                                  "[",
                                                  "]",
                                                  "{",
                                                  "}",
                                                  "=",
                                                  ",",
                                                  "\n",
                                                  "..",
                                                  "/",
                                                  std::string(1, '\0'),
                                                  "\xff\xff\xff\xff",
                                                  "\x7f\xff\xff\xff",
                                                  "é",
                                                  "\r\n\r\n"};
    const std::size_t at = below(input.size() + 1);
    const std::size_t length = below(std::min<std::size_t>(input.size() - std::min(at, input.size()), 64) + 1);
    switch (below(8)) {
      case 0:
        if (at < input.size()) input[at] = static_cast<char>(input[at] ^ (1 << below(8)));
        break;
      case 1:
        if (at < input.size()) input[at] = static_cast<char>(random_());
        break;
      case 2:
        input.erase(at, length);
        break;
      case 3:
        input.insert(at, input.substr(at, length));
        break;
      case 4:
        input.insert(at, kOdd[below(kOdd.size())]);
        break;
      case 5:
        input.replace(at, length, kOdd[below(kOdd.size())]);
        break;
      case 6: {
        const std::string& other = pool[below(pool.size())];
        const std::size_t from = below(other.size() + 1);
        input = input.substr(0, at) + other.substr(from);
        break;
      }
      default:
        input.resize(at);
        break;
    }
  }

  std::mt19937_64 random_;
};

void take(const FuzzTarget& target, const std::string& input) {
  current = &input;
  ::alarm(kHangs_s);
  try {
    target.take({reinterpret_cast<const std::uint8_t*>(input.data()), input.size()});
  } catch (...) {
    std::cerr << target.name << ": an exception came out\n";
    std::abort();
  }
  ::alarm(0);
  current = nullptr;
}

long peak_kb() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss;
}

}  // namespace

int fuzz(const FuzzTarget& target, int argc, char** argv) {
  double seconds = 2.0;
  std::uint64_t seed = std::random_device{}();
  std::vector<std::string> files;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--seconds") == 0 && i + 1 < argc)
      seconds = std::stod(argv[++i]);
    else if (std::strcmp(argv[i], "--seed") == 0 && i + 1 < argc)
      seed = std::stoull(argv[++i]);
    else
      files.emplace_back(argv[i]);
  }
  watch_for_findings(target.name);
  for (const std::string& name : files) {
    std::ifstream file(name, std::ios::binary);
    take(target, std::string(std::istreambuf_iterator<char>(file), {}));
  }
  if (!files.empty()) return 0;
  for (const std::string& good : target.seeds) take(target, good);
  const long before_kb = peak_kb();
  const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  Mutator mutator(seed);
  std::vector<std::string> pool = target.seeds;
  std::size_t inputs = 0;
  while (std::chrono::steady_clock::now() < until) {
    std::string input = mutator.next(pool);
    take(target, input);
    ++inputs;
    if (mutator.below(64) != 0) continue;  // some live on, so that changes add up
    if (pool.size() < kMaxPool)
      pool.push_back(std::move(input));
    else
      pool[target.seeds.size() + mutator.below(kMaxPool - target.seeds.size())] = std::move(input);
  }
  std::cout << target.name << ": " << inputs << " inputs in " << seconds << " s, no finding, seed " << seed
            << ", grew by " << (peak_kb() - before_kb) / 1024 << " MB\n";
  return 0;
}

}  // namespace imprint
