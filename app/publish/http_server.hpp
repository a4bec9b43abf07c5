#pragma once
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "app/publish/file_descriptor.hpp"
#include "app/publish/http_request.hpp"

namespace vergence::app {

struct HttpCounters {
  std::uint64_t requests = 0;      // that were answered
  std::uint64_t refused = 0;       // … with a refusal
  std::uint64_t pushed_out = 0;    // connections closed because others waited for their place
  std::uint64_t viewers = 0;       // that began to look
  std::uint64_t slow_viewers = 0;  // … and were dropped because they did not read
  std::uint64_t skipped = 0;       // events that a viewer had no room for
};

/// A few connections at a time: one page, one stream of events, a few actions.
///
///     HttpServer server(address, policy, page, 4, [&](HttpRoute route) { act(route); });
///     while (!ended) {
///       server.step(std::chrono::milliseconds(100));
///       const HostStamp now = monotonic_now();
///       server.greet("hello", [&] { return state.hello(now); });
///       server.broadcast("update", state.update(now, -1), HttpServer::Skipped::greet_again);
///     }
///
/// Own code, because Debian's cpp-httplib is a compiled library that brings OpenSSL and brotli: six
/// shared libraries more, and `--version` at 14 MB where 12 are allowed; it gives every connection
/// a thread, and its queue of connections has no bound.
/// Threads  One calls everything; wake(): any. Nothing waits but step(), for its timeout.
/// Memory   kConnections places; of each at most one event or the page that waits to be sent.
/// Errors   The constructor throws InputError: the port is in use, the address is not this
///          machine's. Afterwards whatever a client does ends its connection, and counts.
class HttpServer {
 public:
  static constexpr std::size_t kConnections = 24;  // kMostViewers, and some who ask for the page
  static constexpr std::size_t kMostEventBytes = std::size_t{4} << 20U;

  using Action = std::function<void(HttpRoute)>;

  /// `page`: the HTML, outlives it. `viewers`: at most so many at a time.
  HttpServer(const HostPort& address, HttpPolicy policy, std::string_view page, std::size_t viewers,
             Action action);

  /// Waits for clients, at most `timeout`, and serves them.
  void step(std::chrono::milliseconds timeout);
  /// Ends a step() that waits.
  void wake() noexcept;

  [[nodiscard]] std::size_t viewers() const noexcept;
  /// An event for every viewer that has had its greeting; who has not read the last one skips it,
  /// and is greeted anew where what follows builds on it.
  enum class Skipped : std::uint8_t { harmless, greet_again };
  void broadcast(std::string_view name, std::string_view json, Skipped skipped);
  /// The first event for viewers that have just come; `json` is only asked for where there is one.
  void greet(std::string_view name, const std::function<std::string()>& json);
  /// Sends what waits, at most for so long.
  void flush(std::chrono::milliseconds timeout);
  [[nodiscard]] const HttpCounters& counters() const noexcept { return counters_; }

 private:
  using Clock = std::chrono::steady_clock;
  enum class Phase : std::uint8_t { free, reading, answering, greeting, viewing };
  struct Connection {
    FileDescriptor socket{};
    Phase phase = Phase::free;
    std::string in{}, out{};
    std::size_t sent = 0;  // of `out`
    Clock::time_point progress{};

    [[nodiscard]] bool pending() const noexcept { return sent < out.size(); }
    [[nodiscard]] bool looks() const noexcept {
      return phase == Phase::greeting || phase == Phase::viewing;
    }
  };

  void accept_clients();
  Connection* place();
  void read(Connection* c);
  void answer(Connection* c);
  void respond(Connection* c, int status, std::string_view type, std::string_view body);
  void write(Connection* c);
  void close(Connection* c) noexcept;
  void drop_late();
  [[nodiscard]] bool send_event(Connection* c, std::string_view name, std::string_view json);

  HttpPolicy policy_;
  std::string_view page_;
  std::size_t most_viewers_;
  Action action_;
  FileDescriptor listener_, wake_;
  std::array<Connection, kConnections> connections_{};
  HttpCounters counters_{};
};

}  // namespace vergence::app
