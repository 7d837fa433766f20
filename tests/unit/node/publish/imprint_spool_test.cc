#include "node/publish/imprint_spool.h"

#include <csignal>
#include <fstream>

#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>

#include "lib/wire/wire.h"
#include "tests/unit/temporary_folder.h"

namespace imprint {
namespace {

constexpr std::size_t kRoomy = 1U << 20U;

Imprint imprint_of(std::uint64_t sequence) {
  Imprint imprint;
  imprint.camera_id = "cam1";
  imprint.session = "S";
  imprint.boot_id = 7;
  imprint.sequence = sequence;
  imprint.failure = "no forging found";
  return imprint;
}

std::vector<std::uint8_t> bytes_of(std::uint64_t sequence) { return encode_imprint(imprint_of(sequence)); }

std::vector<std::uint64_t> sequences(const ImprintSpool& spool) {
  std::vector<std::uint64_t> numbers;
  for (const auto& entry : spool.entries()) numbers.push_back(entry.number.sequence);
  return numbers;
}

ImprintSpool opened(const std::filesystem::path& folder, std::size_t max_bytes = kRoomy) {
  auto spool = ImprintSpool::open(folder, max_bytes);
  REQUIRE(spool);
  return std::move(*spool);
}

using Numbers = std::vector<std::uint64_t>;

}  // namespace

TEST_CASE("spool: what has no receipt is there after a restart, in order and byte for byte") {
  const TemporaryFolder folder;
  {
    auto spool = opened(folder / "cam1");
    for (const std::uint64_t sequence : {1, 2, 3}) spool.add({7, sequence}, bytes_of(sequence));
    REQUIRE(spool.fault().empty());
    REQUIRE(spool.remove({7, 2}));
    REQUIRE_FALSE(spool.remove({7, 2}));
  }
  auto spool = opened(folder / "cam1");
  REQUIRE(sequences(spool) == Numbers{1, 3});
  REQUIRE(spool.read({7, 3}) == bytes_of(3));
  spool.add({8, 1}, bytes_of(1));
  REQUIRE(spool.entries().back().place > spool.entries()[1].place);
}

TEST_CASE("spool: a kill at any moment leaves whole imprints only, and none that was kept is gone") {
  const TemporaryFolder folder;
  for (int round = 0; round < 10; ++round) {
    int fds[2];
    REQUIRE(pipe(fds) == 0);
    const pid_t child = fork();
    if (child == 0) {
      auto spool = ImprintSpool::open(folder / "cam1", kRoomy);
      for (std::uint64_t sequence = 1; spool; ++sequence) {
        spool->add({100U + static_cast<std::uint64_t>(round), sequence}, bytes_of(sequence));
        if (write(fds[1], &sequence, sizeof sequence) < 0) break;
      }
      _exit(1);
    }
    close(fds[1]);
    std::uint64_t kept = 0;
    for (int i = 0; i < 3 + round; ++i) REQUIRE(read(fds[0], &kept, sizeof kept) == sizeof kept);
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    while (read(fds[0], &kept, sizeof kept) == sizeof kept) continue;
    close(fds[0]);
    auto spool = opened(folder / "cam1");
    std::uint64_t found = 0;
    for (const auto& entry : spool.entries()) {
      if (entry.number.boot_id != 100U + static_cast<std::uint64_t>(round)) continue;
      REQUIRE(entry.number.sequence == ++found);
      REQUIRE(spool.read(entry.number) == bytes_of(found));
    }
    REQUIRE(found >= kept);
    REQUIRE(found <= kept + 1);  // the one that was kept, but not yet told
  }
}

TEST_CASE("spool: when there is no room the oldest end and are counted") {
  const TemporaryFolder folder;
  const std::size_t one = bytes_of(1).size();
  auto spool = opened(folder / "cam1", 3 * one);
  for (std::uint64_t sequence = 1; sequence <= 5; ++sequence) spool.add({7, sequence}, bytes_of(sequence));
  REQUIRE(sequences(spool) == Numbers{3, 4, 5});
  REQUIRE(spool.discarded() == 2);
  REQUIRE(spool.bytes() == 3 * one);
}

TEST_CASE("spool: files that are no imprints are removed and change nothing") {
  const TemporaryFolder folder;
  {
    auto spool = opened(folder / "cam1");
    spool.add({7, 1}, bytes_of(1));
  }
  const auto half = bytes_of(2);
  std::ofstream(folder / "cam1" / "0000000000000002-0000000000000007-0000000000000002.imprint", std::ios::binary)
      .write(reinterpret_cast<const char*>(half.data()), static_cast<std::streamsize>(half.size() / 2));
  std::ofstream(folder / "cam1" / "0000000000000003-0000000000000007-0000000000000003.imprint.a8Xk2q") << "half";
  std::ofstream(folder / "cam1" / "notes.txt") << "hello";
  auto spool = opened(folder / "cam1");
  REQUIRE(sequences(spool) == Numbers{1});
  REQUIRE(std::distance(std::filesystem::directory_iterator(folder / "cam1"), {}) == 2);  // it and the lock
}

TEST_CASE("spool: what the disk does not take stays in memory and is written when it can be") {
  const TemporaryFolder folder;
  auto spool = opened(folder / "cam1");
  spool.add({7, 1}, bytes_of(1));
  std::filesystem::rename(folder / "cam1", folder / "gone");  // as if the disk had been taken away
  spool.add({7, 2}, bytes_of(2));
  REQUIRE(spool.fault().find("cam1") != std::string::npos);
  REQUIRE(spool.read({7, 2}) == bytes_of(2));
  std::filesystem::rename(folder / "gone", folder / "cam1");
  spool.write_pending();
  REQUIRE(spool.fault().empty());
  REQUIRE(std::filesystem::exists(folder / "cam1" / "0000000000000002-0000000000000007-0000000000000002.imprint"));
}

TEST_CASE("spool: one node a folder; without a folder it is in memory alone") {
  const TemporaryFolder folder;
  const auto first = opened(folder / "cam1");
  const auto second = ImprintSpool::open(folder / "cam1", kRoomy);
  REQUIRE_FALSE(second);
  REQUIRE(second.error().exit_status() == 2);
  REQUIRE(second.error().message.find("node.data_dir") != std::string::npos);
  auto in_memory = opened({});
  in_memory.add({7, 1}, bytes_of(1));
  REQUIRE(in_memory.fault().empty());
  REQUIRE(in_memory.read({7, 1}) == bytes_of(1));
}

}  // namespace imprint
