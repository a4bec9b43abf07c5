#include "app/publish/http_server.hpp"

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include <fmt/format.h>

#include "app/runtime/errors.hpp"

namespace vergence::app {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kPatience{5000};  // for a request to arrive, for an answer to be read
constexpr int kBacklog = 64;
constexpr int kAcceptsAStep = 256;
constexpr int kSendBuffer =
    256 * 1024;  // bytes: a slow viewer sees the newest, not the last minute

/// What a browser may do with anything from here: nothing but what the page itself holds.
constexpr const char* kHeaders =
    "Cache-Control: no-store\r\n"
    "X-Content-Type-Options: nosniff\r\n"
    "X-Frame-Options: DENY\r\n"
    "Referrer-Policy: no-referrer\r\n"
    "Content-Security-Policy: default-src 'none'; style-src 'unsafe-inline'; script-src "
    "'unsafe-inline'; img-src data: blob:; connect-src 'self'; base-uri 'none'; form-action "
    "'none'; frame-ancestors 'none'\r\n";

const char* words_of(int status) {
  switch (status) {
    case 200:
      return "OK";
    case 204:
      return "No Content";
    case 400:
      return "Bad Request";
    case 403:
      return "Forbidden";
    case 404:
      return "Not Found";
    case 405:
      return "Method Not Allowed";
    case 413:
      return "Content Too Large";
    case 421:
      return "Misdirected Request";
    case 431:
      return "Request Header Fields Too Large";
    default:
      return "Service Unavailable";
  }
}

FileDescriptor listen_at(const HostPort& address) {
  const auto refuse = [&](const char* why, const char* what_to_do) {
    throw InputError(
        fmt::format("publish.http: no page at {} ({}); {}", address.text(), why, what_to_do));
  };
  addrinfo hints{}, *found = nullptr;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE;
  if (const int error =
          ::getaddrinfo(address.host.c_str(), std::to_string(address.port).c_str(), &hints, &found);
      error != 0)
    refuse(::gai_strerror(error), "give an address of this machine");
  FileDescriptor socket(::socket(found->ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  constexpr int kOn = 1;
  (void)::setsockopt(socket.get(), SOL_SOCKET, SO_REUSEADDR, &kOn, sizeof kOn);
  const bool listens = socket && ::bind(socket.get(), found->ai_addr, found->ai_addrlen) == 0 &&
                       ::listen(socket.get(), kBacklog) == 0;
  const int error = errno;
  ::freeaddrinfo(found);
  if (!listens)
    refuse(std::strerror(error), error == EADDRINUSE
                                     ? "another program has the port: name another one"
                                     : "give an address of this machine and a port from 1024 on");
  return socket;
}

}  // namespace

HttpServer::HttpServer(const HostPort& address, HttpPolicy policy, std::string_view page,
                       std::size_t viewers, Action action)
    : policy_(std::move(policy)),
      page_(page),
      most_viewers_(viewers),
      action_(std::move(action)),
      listener_(listen_at(address)),
      wake_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {}

void HttpServer::wake() noexcept {
  constexpr std::uint64_t kOne = 1;
  (void)!::write(wake_.get(), &kOne, sizeof kOne);
}

std::size_t HttpServer::viewers() const noexcept {
  return static_cast<std::size_t>(std::count_if(connections_.begin(), connections_.end(),
                                                [](const Connection& c) { return c.looks(); }));
}

void HttpServer::step(milliseconds timeout) {
  std::array<pollfd, kConnections + 2> polled{};
  polled[kConnections] = {listener_.get(), POLLIN, 0};
  polled[kConnections + 1] = {wake_.get(), POLLIN, 0};
  bool waits = false;  // somebody has a deadline
  for (std::size_t i = 0; i < kConnections; ++i) {
    const Connection& c = connections_[i];
    polled[i] = {c.socket.get(), static_cast<short>(c.pending() ? POLLIN | POLLOUT : POLLIN), 0};
    waits = waits || c.phase == Phase::reading || c.pending();
  }
  const milliseconds limit = waits ? std::min(timeout, milliseconds(500)) : timeout;
  (void)::poll(polled.data(), polled.size(), static_cast<int>(limit.count()));
  std::uint64_t ignored = 0;
  if (polled[kConnections + 1].revents != 0) (void)!::read(wake_.get(), &ignored, sizeof ignored);
  for (std::size_t i = 0; i < kConnections; ++i) {
    Connection& c = connections_[i];
    const auto happened = static_cast<unsigned>(polled[i].revents);
    if (c.phase == Phase::free || happened == 0) continue;
    if ((happened & (POLLIN | POLLHUP | POLLERR)) != 0) read(&c);
    if (c.phase != Phase::free && (happened & POLLOUT) != 0) write(&c);
  }
  if (polled[kConnections].revents != 0) accept_clients();
  drop_late();
}

/// A free place, or that of the one who has been asking for longest; viewers keep theirs.
HttpServer::Connection* HttpServer::place() {
  Connection* oldest = nullptr;
  for (Connection& c : connections_) {
    if (c.phase == Phase::free) return &c;
    if (!c.looks() && (oldest == nullptr || c.progress < oldest->progress)) oldest = &c;
  }
  ++counters_.pushed_out;
  close(oldest);  // there is one: most_viewers_ is below kConnections
  return oldest;
}

void HttpServer::accept_clients() {
  for (int i = 0; i < kAcceptsAStep; ++i) {
    FileDescriptor socket(
        ::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (!socket) return;
    constexpr int kOn = 1;
    (void)::setsockopt(socket.get(), IPPROTO_TCP, TCP_NODELAY, &kOn, sizeof kOn);
    (void)::setsockopt(socket.get(), SOL_SOCKET, SO_SNDBUF, &kSendBuffer, sizeof kSendBuffer);
    Connection* c = place();
    c->socket = std::move(socket);
    c->phase = Phase::reading;
    c->progress = Clock::now();
  }
}

void HttpServer::close(Connection* c) noexcept {
  c->socket.reset();
  c->phase = Phase::free;
  c->in.clear();
  c->out.clear();
  c->out.shrink_to_fit();
  c->sent = 0;
}

void HttpServer::read(Connection* c) {
  std::array<char, kMostRequestBytes> bytes;
  const ssize_t n = ::recv(c->socket.get(), bytes.data(), bytes.size(), MSG_DONTWAIT);
  if (n == 0 || (n < 0 && errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR))
    return close(c);
  // Of a request that is being answered, whatever else comes is nothing.
  if (n < 0 || c->phase != Phase::reading) return;
  c->in.append(bytes.data(),
               std::min(static_cast<std::size_t>(n), kMostRequestBytes - c->in.size()));
  answer(c);
}

void HttpServer::answer(Connection* c) {
  HttpRequest request;
  const HttpParse parsed = parse_http_request(c->in, &request);
  if (parsed == HttpParse::incomplete) return;
  ++counters_.requests;
  HttpDecision decision{HttpRoute::refuse, 400, "this is no HTTP request"};
  if (parsed == HttpParse::too_large)
    decision = {HttpRoute::refuse, 431, "the request is too long"};
  if (parsed == HttpParse::complete) decision = decide(request, policy_);
  if (decision.route == HttpRoute::events && viewers() >= most_viewers_)
    decision = {HttpRoute::refuse, 503, "as many as publish.viewers allows are looking already"};
  switch (decision.route) {
    case HttpRoute::refuse:
      ++counters_.refused;
      return respond(c, decision.status, "text/plain; charset=utf-8",
                     std::string(decision.sentence) + "\n");
    case HttpRoute::page:
      return respond(c, decision.status, "text/html; charset=utf-8", page_);
    case HttpRoute::events:
      ++counters_.viewers;
      c->phase = Phase::greeting;
      c->out = fmt::format(
          "HTTP/1.1 200 OK\r\nContent-Type: text/event-stream\r\nConnection: close\r\n{}\r\n"
          "retry: 1000\n\n",
          kHeaders);
      return write(c);
    default:
      action_(decision.route);
      return respond(c, decision.status, "text/plain", "");
  }
}

void HttpServer::respond(Connection* c, int status, std::string_view type, std::string_view body) {
  c->phase = Phase::answering;
  c->out = fmt::format(
      "HTTP/1.1 {} {}\r\nContent-Type: {}\r\nContent-Length: {}\r\nConnection: close\r\n{}\r\n{}",
      status, words_of(status), type, body.size(), kHeaders, body);
  c->progress = Clock::now();
  write(c);
}

void HttpServer::write(Connection* c) {
  if (c->pending()) {
    const ssize_t n = ::send(c->socket.get(), c->out.data() + c->sent, c->out.size() - c->sent,
                             MSG_DONTWAIT | MSG_NOSIGNAL);
    if (n < 0 && errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR) return close(c);
    if (n > 0) {
      c->sent += static_cast<std::size_t>(n);
      c->progress = Clock::now();
    }
  }
  if (c->pending()) return;
  c->out.clear();
  c->sent = 0;
  if (c->phase != Phase::answering) return;
  (void)::shutdown(c->socket.get(), SHUT_WR);
  close(c);
}

/// Who sends no request, or does not read.
void HttpServer::drop_late() {
  const auto now = Clock::now();
  for (Connection& c : connections_) {
    const bool owes = c.phase == Phase::reading || (c.phase != Phase::free && c.pending());
    if (!owes || now - c.progress < kPatience) continue;
    if (c.looks()) ++counters_.slow_viewers;
    close(&c);
  }
}

bool HttpServer::send_event(Connection* c, std::string_view name, std::string_view json) {
  if (c->pending() || json.size() > kMostEventBytes) {
    ++counters_.skipped;
    return false;
  }
  c->out = fmt::format("event: {}\ndata: {}\n\n", name, json);
  c->progress = Clock::now();
  write(c);
  return true;
}

void HttpServer::broadcast(std::string_view name, std::string_view json, Skipped skipped) {
  for (Connection& c : connections_)
    if (c.phase == Phase::viewing && !send_event(&c, name, json) && skipped == Skipped::greet_again)
      c.phase = Phase::greeting;
}

void HttpServer::greet(std::string_view name, const std::function<std::string()>& json) {
  std::string text;
  for (Connection& c : connections_) {
    if (c.phase != Phase::greeting || c.pending()) continue;
    if (text.empty()) text = json();
    c.phase = Phase::viewing;
    (void)send_event(&c, name, text);
  }
}

void HttpServer::flush(milliseconds timeout) {
  const auto end = Clock::now() + timeout;
  const auto waits = [this] {
    return std::any_of(connections_.begin(), connections_.end(),
                       [](const Connection& c) { return c.pending(); });
  };
  while (waits() && Clock::now() < end) step(milliseconds(20));
}

}  // namespace vergence::app
