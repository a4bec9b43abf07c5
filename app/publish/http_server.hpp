#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <string>
#include <string_view>

#include "app/publish/line_socket.hpp"

struct MHD_Connection;
struct MHD_Daemon;

namespace vergence::app {

/// Fields of a request's head that the live page uses.
struct HttpRequest {
  /// The path has no query.
  std::string_view method{}, path{};
  /// Value of the header X-Vergence-Token or of the query `token=`.
  std::string_view token{};
  std::string_view host{}, origin{};
  bool token_in_header = false;
  bool has_body = false;
};

/// Whom the live page answers.
struct HttpPolicy {
  std::string token{};
  bool token_to_read = false;  // bound beyond this machine
  std::string host{};          // of the configuration; a Host header may name it
};

enum class HttpRoute : std::uint8_t { refuse, page, events, recalibrate, mark, stop_recording };

struct HttpDecision {
  HttpRoute route = HttpRoute::refuse;
  unsigned status = 200;
  const char* message = "";  // of a refusal
};

/// The page itself holds nothing of the session and is for everyone; events want the token where
/// the policy says so; actions always, in a header that no other site's page can send, from no
/// other origin. On this machine the Host header must name it: a name that another host lets
/// point here does not (DNS rebinding).
[[nodiscard]] HttpDecision decide(const HttpRequest& request, const HttpPolicy& policy) noexcept;

/// One page, one stream of events, a few actions, by libmicrohttpd.
///
///     HttpServer server(address, policy, page, 4, [&](HttpRoute route) { act(route); });
///     while (!ended) {
///       server.step(std::chrono::milliseconds(100));
///       const HostStamp now = monotonic_now();
///       server.greet("hello", [&] { return state.hello(now); });
///       server.broadcast("update", state.update(now, -1), HttpServer::Skipped::greet_again);
///     }
///
/// Threads  One calls everything. Nothing waits but step() and flush(), for their timeouts.
/// Memory   kConnections connections of kRequestBytes; of each viewer at most one event that waits
///          to be sent. Who sends no request, or does not read, is dropped after a few seconds.
/// Errors   The constructor throws InputError: the port is in use, the address is not this
///          machine's. Afterwards whatever a client does ends its connection.
class HttpServer {
 public:
  static constexpr unsigned kConnections = 64;
  static constexpr std::size_t kAsking = 24;  // connections without a request; the oldest goes
  static constexpr std::size_t kRequestBytes = std::size_t{8} << 10U;  // browsers send some 600
  static constexpr std::size_t kMaxEventBytes = std::size_t{4} << 20U;

  using Action = std::function<void(HttpRoute)>;

  /// `page`: the HTML, outlives it. `viewers`: at most so many at a time.
  HttpServer(const HostPort& address, HttpPolicy policy, std::string_view page, std::size_t viewers,
             Action action);
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  /// Waits for clients, at most `timeout`, and serves them.
  void step(std::chrono::milliseconds timeout);

  [[nodiscard]] std::size_t viewers() const noexcept { return viewers_.size(); }
  /// An event for every viewer that has had its greeting; who has not read the last one skips it,
  /// and is greeted anew where what follows builds on it.
  enum class Skipped : std::uint8_t { harmless, greet_again };
  void broadcast(std::string_view name, std::string_view json, Skipped skipped);
  /// The first event for viewers that have just come; `json` is only asked for where there is one.
  void greet(std::string_view name, const std::function<std::string()>& json);
  /// Sends what waits, at most for so long.
  void flush(std::chrono::milliseconds timeout);

 private:
  /// Reader of the event stream. The library asks for its bytes, and sleeps while there are
  /// none.
  struct Viewer {
    HttpServer* server = nullptr;
    MHD_Connection* connection = nullptr;
    std::string out{};
    std::size_t sent = 0;  // of `out`
    bool greeted = false, asleep = false;

    [[nodiscard]] bool pending() const noexcept { return sent < out.size(); }
  };
  struct StopDaemon {
    void operator()(MHD_Daemon* daemon) const noexcept;
  };
  struct Callbacks;  // of the library

  [[nodiscard]] bool answer(MHD_Connection* connection, const HttpRequest& request);
  [[nodiscard]] bool begin_events(MHD_Connection* connection);
  [[nodiscard]] bool send_event(Viewer* viewer, std::string_view name, std::string_view json);
  static void wake(Viewer* viewer) noexcept;

  const HttpPolicy policy_;
  const std::string_view page_;
  const std::size_t max_viewers_;
  const Action action_;
  std::list<Viewer> viewers_;
  std::list<MHD_Connection*> asking_;  // that have sent no request yet, the oldest first
  std::unique_ptr<MHD_Daemon, StopDaemon> daemon_;  // last: it uses the others
};

}  // namespace vergence::app
