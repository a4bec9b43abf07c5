#include "app/publish/http_server.hpp"

#include <microhttpd.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <exception>

namespace vergence::app {
namespace {

using std::chrono::milliseconds;

// Time in s for a request to arrive and for a response to be read.
constexpr unsigned kPatience = 4;
constexpr int kBacklog = 1024;

/// The content security policy allows only the page's own content.
constexpr std::array<std::pair<const char*, const char*>, 5> kHeaders{{
    {"Cache-Control", "no-store"},
    {"X-Content-Type-Options", "nosniff"},
    {"X-Frame-Options", "DENY"},
    {"Referrer-Policy", "no-referrer"},
    {"Content-Security-Policy",
     "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data: "
     "blob:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"},
}};

/// Name in a Host header, without port and brackets.
std::string_view host_name(std::string_view host) noexcept {
  if (host.starts_with('[')) {
    const auto end = host.find(']');
    return end == std::string_view::npos ? host : host.substr(1, end - 1);
  }
  return host.substr(0, host.find(':'));
}

bool names_this_machine(std::string_view host, const HttpPolicy& policy) noexcept {
  const std::string name(host_name(host));
  return name == policy.host || HostPort{name}.loopback();
}

/// Compares in constant time. An empty token never matches.
bool same_token(std::string_view a, std::string_view b) noexcept {
  if (a.size() != b.size() || b.empty()) return false;
  unsigned difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    difference |=
        static_cast<unsigned>(static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i]));
  return difference == 0;
}

bool same_origin(const HttpRequest& r) noexcept {
  constexpr std::string_view kScheme = "http://";
  return r.origin.empty() ||
         (r.origin.starts_with(kScheme) && r.origin.substr(kScheme.size()) == r.host);
}

HttpDecision decide_action(HttpRoute route, const HttpRequest& r,
                           const HttpPolicy& policy) noexcept {
  if (!r.token_in_header || !same_token(r.token, policy.token))
    return {HttpRoute::refuse, 403, "the token is not of this session"};
  if (!same_origin(r)) return {HttpRoute::refuse, 403, "refused: the request is from another site"};
  if (r.has_body) return {HttpRoute::refuse, 413, "a GET has no body"};
  return {route, 204, ""};
}

FileDescriptor listen_at(const HostPort& address) {
  const auto refused = [&](const char* why, const char* what_to_do) {
    return InputError("publish.http: the live page cannot be served at {} ({}); {}", address.text(),
                      why, what_to_do);
  };
  const auto found = resolve(address, SOCK_STREAM, [&](const char* reason) {
    return refused(reason, "use an address of this machine");
  });
  FileDescriptor socket(::socket(found->ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  constexpr int kOn = 1;
  (void)::setsockopt(socket.get(), SOL_SOCKET, SO_REUSEADDR, &kOn, sizeof kOn);
  if (!socket || ::bind(socket.get(), found->ai_addr, found->ai_addrlen) != 0 ||
      ::listen(socket.get(), kBacklog) != 0)
    throw refused(std::strerror(errno),
                  errno == EADDRINUSE
                      ? "another program uses the port; choose another one"
                      : "use an address of this machine and a port of 1024 or above");
  return socket;
}

std::string_view find_value(MHD_Connection* c, MHD_ValueKind kind, const char* name) noexcept {
  const char* value = ::MHD_lookup_connection_value(c, kind, name);
  return value == nullptr ? std::string_view() : value;
}

bool send(MHD_Connection* c, unsigned status, const char* type, std::string_view body) {
  std::string bytes(body);
  MHD_Response* response =
      ::MHD_create_response_from_buffer(bytes.size(), bytes.data(), MHD_RESPMEM_MUST_COPY);
  if (response == nullptr) return false;
  (void)::MHD_add_response_header(response, "Content-Type", type);
  for (const auto& [name, value] : kHeaders) (void)::MHD_add_response_header(response, name, value);
  const bool queued = ::MHD_queue_response(c, status, response) == MHD_YES;
  ::MHD_destroy_response(response);
  return queued;
}

}  // namespace

HttpDecision decide(const HttpRequest& r, const HttpPolicy& policy) noexcept {
  constexpr std::array kActions{std::pair{"/recalibrate", HttpRoute::recalibrate},
                                std::pair{"/mark", HttpRoute::mark},
                                std::pair{"/stop-recording", HttpRoute::stop_recording}};
  if (!policy.token_to_read && !names_this_machine(r.host, policy))
    return {HttpRoute::refuse, 421, "this page is for this machine; open it by its address"};
  if (r.method == "POST") {
    for (const auto& [path, action] : kActions)
      if (r.path == path) return decide_action(action, r, policy);
    return {HttpRoute::refuse, 404, "there is no such action"};
  }
  if (r.method != "GET") return {HttpRoute::refuse, 405, "only GET and POST are supported"};
  if (r.path == "/") return {HttpRoute::page, 200, ""};
  if (r.path != "/state") return {HttpRoute::refuse, 404, "there is no such page"};
  if (policy.token_to_read && !same_token(r.token, policy.token))
    return {HttpRoute::refuse, 403, "the token is not of this session"};
  return {HttpRoute::state, 200, ""};
}

/// No exception may propagate through the library.
struct HttpServer::Callbacks {
  static MHD_Result request(void* server, MHD_Connection* c, const char* url, const char* method,
                            const char* /*version*/, const char* /*body*/, std::size_t* /*size*/,
                            void** /*state*/) noexcept {
    static_cast<HttpServer*>(server)->asking_.remove(c);
    HttpRequest r{.method = method, .path = url};
    const auto header = [c](const char* name) { return find_value(c, MHD_HEADER_KIND, name); };
    const auto query = [c](const char* name) { return find_value(c, MHD_GET_ARGUMENT_KIND, name); };
    r.host = header("Host");
    r.origin = header("Origin");
    r.token = header("X-Vergence-Token");
    r.token_in_header = !r.token.empty();
    if (!r.token_in_header) r.token = query("token");
    const std::string_view length = header("Content-Length");
    r.has_body = (!length.empty() && length != "0") || !header("Transfer-Encoding").empty();
    r.epoch = query("epoch");
    r.after = query("after");
    r.image = query("image");
    try {
      return static_cast<HttpServer*>(server)->answer(c, r) ? MHD_YES : MHD_NO;
    } catch (const std::exception&) {
      return MHD_NO;
    }
  }

  static void connection(void* server, MHD_Connection* c, void** /*state*/,
                         MHD_ConnectionNotificationCode what) noexcept {
    auto& asking = static_cast<HttpServer*>(server)->asking_;
    asking.remove(c);
    if (what != MHD_CONNECTION_NOTIFY_STARTED) return;
    try {
      asking.push_back(c);
    } catch (const std::exception&) {
    }
    if (asking.size() <= kAsking) return;
    // The library closes the connection after its shutdown.
    const MHD_ConnectionInfo* socket =
        ::MHD_get_connection_info(asking.front(), MHD_CONNECTION_INFO_CONNECTION_FD);
    if (socket != nullptr) (void)::shutdown(socket->connect_fd, SHUT_RDWR);
    asking.pop_front();
  }
};

HttpServer::HttpServer(const HostPort& address, HttpPolicy policy, std::string_view page,
                       Handler handler)
    : policy_(std::move(policy)), page_(page), handler_(std::move(handler)) {
  FileDescriptor listener = listen_at(address);
  daemon_.reset(::MHD_start_daemon(
      MHD_USE_EPOLL, 0, nullptr, nullptr, &Callbacks::request, this, MHD_OPTION_NOTIFY_CONNECTION,
      &Callbacks::connection, this, MHD_OPTION_LISTEN_SOCKET, listener.get(),
      MHD_OPTION_CONNECTION_LIMIT, kConnections, MHD_OPTION_CONNECTION_MEMORY_LIMIT, kRequestBytes,
      MHD_OPTION_CONNECTION_TIMEOUT, kPatience, MHD_OPTION_STRICT_FOR_CLIENT, 1, MHD_OPTION_END));
  if (daemon_ == nullptr)
    throw InputError(
        "publish.http: the system has no memory or file descriptors left for the live page; raise "
        "its limits (ulimit -n)");
  listener.release();
}

HttpServer::~HttpServer() = default;

void HttpServer::StopDaemon::operator()(MHD_Daemon* daemon) const noexcept {
  ::MHD_stop_daemon(daemon);
}

void HttpServer::step(milliseconds timeout) {
  (void)::MHD_run_wait(daemon_.get(), static_cast<std::int32_t>(timeout.count()));
}

bool HttpServer::answer(MHD_Connection* c, const HttpRequest& request) {
  const HttpDecision decision = decide(request, policy_);
  if (decision.route == HttpRoute::refuse)
    return send(c, decision.status, "text/plain; charset=utf-8",
                std::string(decision.message) + "\n");
  if (decision.route == HttpRoute::page)
    return send(c, decision.status, "text/html; charset=utf-8", page_);
  const std::string body = handler_(decision.route, request);
  return send(c, body.empty() ? 204 : decision.status, "application/json", body);
}

}  // namespace vergence::app
