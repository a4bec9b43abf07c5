#pragma once
#include <chrono>
#include <cstddef>
#include <list>

#include "app/publish/line_socket.hpp"

struct MHD_Connection;
struct MHD_Daemon;

namespace vergence::app {

/// Fields of a request that the live page uses.
struct HttpRequest {
  /// `path` excludes the query.
  std::string_view method{}, path{};
  /// Value of the header X-Vergence-Token or of the query `token=`.
  std::string_view token{};
  std::string_view host{}, origin{};
  bool token_in_header = false;
  bool has_body = false;
  // Data that the viewer already has, in a request for /state (LivePage).
  std::string_view epoch{}, after{}, image{};
};

/// Access rules of the live page.
struct HttpPolicy {
  std::string token{};
  /// Set if bound to an address beyond this machine.
  bool token_to_read = false;
  /// Configured host, which a Host header may name.
  std::string host{};
};

enum class HttpRoute : std::uint8_t { refuse, page, state, recalibrate, mark, stop_recording };

struct HttpDecision {
  HttpRoute route = HttpRoute::refuse;
  unsigned status = 200;
  /// Reason for a refusal.
  const char* message = "";
};

/// The page has no session data and is public. The state needs the token if the policy requires it.
/// Actions always need it, in a header that pages of other origins cannot send. On this machine the
/// Host header must name it, because another host's name may resolve to it (DNS rebinding).
[[nodiscard]] HttpDecision decide(const HttpRequest& request, const HttpPolicy& policy) noexcept;

/// Serves one page, one state that viewers poll, and a few actions, by libmicrohttpd.
///
///     HttpServer server(address, policy, page, [&](HttpRoute route, const HttpRequest& request) {
///       return route == HttpRoute::state ? state_json(request) : act(route);
///     });
///     while (!ended) server.step(std::chrono::milliseconds(100));
///
/// Threads  One thread makes all calls; step() calls the handler. Only step() waits, for its
///          timeout.
/// Memory   kConnections connections of kRequestBytes with a response each. A client that sends no
///          request or does not read is dropped after a few seconds.
/// Errors   The constructor throws InputError if the port is in use or the address is not this
///          machine's. Later errors end the client's connection.
class HttpServer {
 public:
  static constexpr unsigned kConnections = 64;
  /// Maximum number of connections without a request; the oldest is closed.
  static constexpr std::size_t kAsking = 24;
  /// Browsers send some 600 bytes.
  static constexpr std::size_t kRequestBytes = std::size_t{8} << 10U;

  /// Handles an admitted request. Returns the state as JSON, empty if there is none yet; actions
  /// return nothing.
  using Handler = std::function<std::string(HttpRoute route, const HttpRequest& request)>;

  /// `page` is the HTML, which must outlive the server.
  HttpServer(const HostPort& address, HttpPolicy policy, std::string_view page, Handler handler);
  ~HttpServer();

  /// Waits for clients, at most `timeout`, and serves them.
  void step(std::chrono::milliseconds timeout);

 private:
  struct StopDaemon {
    void operator()(MHD_Daemon* daemon) const noexcept;
  };
  // Callbacks of the library.
  struct Callbacks;

  [[nodiscard]] bool answer(MHD_Connection* connection, const HttpRequest& request);

  const HttpPolicy policy_;
  const std::string_view page_;
  const Handler handler_;
  // Connections without a request yet, oldest first.
  std::list<MHD_Connection*> asking_;
  // Last member, because it uses the others.
  std::unique_ptr<MHD_Daemon, StopDaemon> daemon_;
};

}  // namespace vergence::app
