#include "lib/daemon/systemd_notice.h"

#include <array>

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <catch2/catch.hpp>

#include "tests/unit/temporary_folder.h"

namespace imprint {
namespace {

using namespace std::chrono_literals;

// systemd's end of the notification socket.
class Systemd {
 public:
  Systemd() : socket_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    const std::string path = folder_ / "notify";
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    REQUIRE(path.copy(address.sun_path, sizeof address.sun_path - 1) == path.size());
    REQUIRE(::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
    ::setenv("NOTIFY_SOCKET", path.c_str(), 1);
  }
  Systemd(const Systemd&) = delete;
  Systemd& operator=(const Systemd&) = delete;
  ~Systemd() {
    for (const char* name : {"NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID"}) ::unsetenv(name);
    ::close(socket_);
  }

  // The next message; empty: none was sent.
  [[nodiscard]] std::string heard() const {
    std::array<char, 256> buffer{};
    const ssize_t size = ::recv(socket_, buffer.data(), buffer.size(), MSG_DONTWAIT);
    return size < 0 ? "" : std::string(buffer.data(), static_cast<std::size_t>(size));
  }

 private:
  TemporaryFolder folder_;
  int socket_;
};

}  // namespace

TEST_CASE("systemd notice: says when the service is ready and when it stops") {
  const Systemd systemd;
  notify_ready("fusion ready");
  REQUIRE(systemd.heard() == "READY=1\nSTATUS=fusion ready");
  notify_stopping();
  REQUIRE(systemd.heard() == "STOPPING=1");
}

TEST_CASE("systemd notice: the watchdog is due twice in the time that the unit allows; never without one") {
  const Systemd systemd;
  REQUIRE_FALSE(watchdog_period());
  ::setenv("WATCHDOG_USEC", "20000000", 1);
  REQUIRE(watchdog_period() == 10s);
  ::setenv("WATCHDOG_PID", "1", 1);  // meant for another process
  REQUIRE_FALSE(watchdog_period());
}

TEST_CASE("systemd notice: a loop that has not turned since lets the watchdog run out, one that turns again does not") {
  const Systemd systemd;
  std::uint64_t turns = 0;
  LoopWatchdog watchdog({[&] { return turns; }});
  REQUIRE(watchdog.attend());
  REQUIRE(systemd.heard() == "WATCHDOG=1");
  REQUIRE_FALSE(watchdog.attend());
  REQUIRE_FALSE(watchdog.attend());
  REQUIRE(systemd.heard().empty());
  turns += 3;
  REQUIRE(watchdog.attend());
  REQUIRE(systemd.heard() == "WATCHDOG=1");
}

TEST_CASE("systemd notice: of two loops each must turn") {
  const Systemd systemd;
  std::uint64_t one = 0;
  std::uint64_t other = 0;
  LoopWatchdog watchdog({[&] { return one; }, [&] { return other; }});
  REQUIRE(watchdog.attend());
  ++one;
  REQUIRE_FALSE(watchdog.attend());
  ++other;
  REQUIRE(watchdog.attend());
}

}  // namespace imprint
