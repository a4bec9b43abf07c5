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
  // A request for /state names what the viewer already has (LivePage).
  std::string_view epoch{}, after{}, image{};
};

/// Whom the live page answers.
struct HttpPolicy {
  std::string token{};
  bool token_to_read = false;  // bound beyond this machine
  std::string host{};          // of the configuration; a Host header may name it
};

enum class HttpRoute : std::uint8_t { refuse, page, state, recalibrate, mark, stop_recording };

struct HttpDecision {
  HttpRoute route = HttpRoute::refuse;
  unsigned status = 200;
  const char* message = "";  // of a refusal
};

/// The page itself holds nothing of the session and is for everyone; the state needs the token
/// where the policy says so; actions always, in a header that no other site's page can send, from
/// no other origin. On this machine the Host header must name it: a name that another host lets
/// point here does not (DNS rebinding).
[[nodiscard]] HttpDecision decide(const HttpRequest& request, const HttpPolicy& policy) noexcept;

/// One page, one state that viewers ask for again and again, a few actions, by libmicrohttpd.
///
///     HttpServer server(address, policy, page, [&](HttpRoute route, const HttpRequest& request) {
///       return route == HttpRoute::state ? state_json(request) : act(route);
///     });
///     while (!ended) server.step(std::chrono::milliseconds(100));
///
/// Threads  One calls everything, and is called by step(). Nothing waits but step(), for its
///          timeout.
/// Memory   kConnections connections of kRequestBytes and a response each. A client that sends no
///          request, or does not read, is dropped after a few seconds.
/// Errors   The constructor throws InputError: the port is in use, the address is not this
///          machine's. Afterwards whatever a client does ends its connection.
class HttpServer {
 public:
  static constexpr unsigned kConnections = 64;
  static constexpr std::size_t kAsking = 24;  // connections without a request; the oldest goes
  static constexpr std::size_t kRequestBytes = std::size_t{8} << 10U;  // browsers send some 600

  /// Carries out an admitted request. Returns the state as JSON, empty: there is none yet; of an
  /// action nothing.
  using Handler = std::function<std::string(HttpRoute route, const HttpRequest& request)>;

  /// `page`: the HTML, outlives it.
  HttpServer(const HostPort& address, HttpPolicy policy, std::string_view page, Handler handler);
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  /// Waits for clients, at most `timeout`, and serves them.
  void step(std::chrono::milliseconds timeout);

 private:
  struct StopDaemon {
    void operator()(MHD_Daemon* daemon) const noexcept;
  };
  struct Callbacks;  // of the library

  [[nodiscard]] bool answer(MHD_Connection* connection, const HttpRequest& request);

  const HttpPolicy policy_;
  const std::string_view page_;
  const Handler handler_;
  std::list<MHD_Connection*> asking_;  // that have sent no request yet, the oldest first
  std::unique_ptr<MHD_Daemon, StopDaemon> daemon_;  // last: it uses the others
};

}  // namespace vergence::app
