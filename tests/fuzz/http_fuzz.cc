// The page's HTTP API, as bytes on its socket.
#include "fusion/serve/page_server.h"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <iostream>

#include <spdlog/spdlog.h>

#include "tests/fuzz/fuzz.h"
#include "tests/unit/temporary_folder.h"

namespace imprint {
namespace {

int connected(int port, timeval patience) {
  const int link = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  ::setsockopt(link, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (::connect(link, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return link;
  ::close(link);
  return -1;
}

constexpr timeval kFiveSeconds{5, 0};
constexpr timeval kAMoment{0, 20'000};  // it may wait for more that never comes

// What the server says to the bytes, up to its first words.
std::string said_to(int port, std::span<const std::uint8_t> bytes, timeval patience) {
  const int link = connected(port, patience);
  if (link < 0) return {};
  [[maybe_unused]] const auto sent = ::send(link, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  char buffer[512];
  const auto got = ::recv(link, buffer, sizeof buffer, 0);
  ::close(link);
  return got > 0 ? std::string(buffer, static_cast<std::size_t>(got)) : std::string();
}

std::string post(const std::string& path, const std::string& body) {
  return "POST " + path + " HTTP/1.1\r\nHost: localhost\r\nX-Imprint: 1\r\nConnection: close\r\nContent-Length: " +
         std::to_string(body.size()) + "\r\n\r\n" + body;
}
std::string get(const std::string& path) {
  return "GET " + path + " HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";
}

}  // namespace
}  // namespace imprint

int main(int argc, char** argv) {
  using namespace imprint;
  spdlog::set_level(spdlog::level::off);
  const TemporaryFolder folder;
  LineBoard board({"plant", "L1", "best", "0.1.0"}, {"cam1"}, std::chrono::steady_clock::now());
  auto store = SessionStore::open(folder / "imprint.db");
  LineControl control;
  control.connect([](const Trigger&) { return Result<void>(); });
  const auto page = PageServer::start({.address = "127.0.0.1", .port = 0}, board, **store, control);
  if (!page) {
    std::cerr << page.error().message << '\n';
    return 1;
  }
  const int port = (*page)->port();
  const std::string alive = get("/healthz");
  const auto take = [&](std::span<const std::uint8_t> bytes) {
    (void)said_to(port, bytes, kAMoment);
    const std::string answer =
        said_to(port, {reinterpret_cast<const std::uint8_t*>(alive.data()), alive.size()}, kFiveSeconds);
    if (!answer.starts_with("HTTP/1.1 200")) {
      std::cerr << "the page no longer answers: " << answer << '\n';
      std::abort();
    }
  };
  return fuzz({"http",
               {get("/api/status"), get("/api/result/S-1"), get("/metrics"), get("/api/plots/latest"),
                post("/api/trigger", R"({"session": "S", "observation": 1})"),
                post("/api/acknowledge", R"({"alarm": "store"})"),
                post("/api/sign-in", R"({"name": "otto", "password": "red steel 1200"})")},
               take},
              argc, argv);
}
