#include "app/doctor/machine.hpp"

#include <arpa/inet.h>
#include <grp.h>
#include <ifaddrs.h>
#include <netinet/in.h>
#include <pwd.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <sys/timex.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <fstream>
#include <sstream>
#include <string_view>
#include <system_error>
#include <utility>

namespace vergence::app {
namespace fs = std::filesystem;
namespace {

std::string_view trimmed(std::string_view s) {
  const auto first = s.find_first_not_of(" \t\r\n");
  if (first == std::string_view::npos) return {};
  return s.substr(first, s.find_last_not_of(" \t\r\n") - first + 1);
}

template <class Integer>
std::optional<Integer> whole_number(const std::optional<std::string>& text, int base) {
  if (!text || text->empty()) return std::nullopt;
  Integer value{};
  const char* end = text->data() + text->size();
  const auto [stop, error] = std::from_chars(text->data(), end, value, base);
  if (error != std::errc() || stop != end) return std::nullopt;
  return value;
}

/// Empty: there is none. Not thread-safe, as getgrgid().
std::string group_name(gid_t id) {
  const ::group* found = ::getgrgid(id);
  return found == nullptr ? std::string() : found->gr_name;
}

std::vector<std::string> own_groups() {
  std::vector<gid_t> ids(static_cast<std::size_t>(std::max(0, ::getgroups(0, nullptr))));
  (void)::getgroups(static_cast<int>(ids.size()), ids.data());
  ids.push_back(::getegid());
  std::vector<std::string> names;
  for (const gid_t id : ids) names.push_back(group_name(id));
  return names;
}

std::vector<InterfaceAddress> own_addresses() {
  std::vector<InterfaceAddress> all;
  ifaddrs* list = nullptr;
  if (::getifaddrs(&list) != 0) return all;
  const auto host_order = [](const sockaddr* a) {
    sockaddr_in in{};
    if (a != nullptr) std::memcpy(&in, a, sizeof in);
    return ntohl(in.sin_addr.s_addr);
  };
  for (const ifaddrs* i = list; i != nullptr; i = i->ifa_next)
    if (i->ifa_addr != nullptr && i->ifa_addr->sa_family == AF_INET)
      all.push_back({i->ifa_name, host_order(i->ifa_addr), host_order(i->ifa_netmask)});
  ::freeifaddrs(list);
  return all;
}

std::string group_of_node(const std::string& node) {
  struct stat s {};
  if (::stat(node.c_str(), &s) != 0) return {};
  return group_name(s.st_gid);
}

std::optional<DiskRoom> room_of(const fs::path& folder) {
  // The folder may still have to be made, or be closed to this user: what counts is the disk that
  // it will be on, by the first folder above it that tells.
  std::error_code error;
  fs::path at = fs::absolute(folder, error);
  if (error) return std::nullopt;
  struct statvfs s {};
  bool closed = false;
  while (::statvfs(at.c_str(), &s) != 0) {
    closed = closed || errno == EACCES;
    if (!at.has_relative_path()) return std::nullopt;
    at = at.parent_path();
  }
  DiskRoom room;
  room.bytes = static_cast<std::uint64_t>(s.f_bavail) * s.f_frsize;
  room.read_only = (s.f_flag & ST_RDONLY) != 0;
  room.may_write = !closed && ::access(at.c_str(), W_OK | X_OK) == 0;
  return room;
}

std::optional<bool> kernel_clock_synchronised() {
  timex t{};
  const int state = ::adjtimex(&t);
  if (state < 0) return std::nullopt;
  return state != TIME_ERROR && (t.status & STA_UNSYNC) == 0;
}

}  // namespace

Machine Machine::here() {
  Machine m;
  if (const passwd* self = ::getpwuid(::getuid())) m.user = self->pw_name;
  m.groups = own_groups();
  m.addresses = own_addresses();
  m.may_use = [](const std::string& node) { return ::access(node.c_str(), R_OK | W_OK) == 0; };
  m.group_of = group_of_node;
  m.room_at = room_of;
  m.clock_synchronised = kernel_clock_synchronised();
  return m;
}

fs::path Machine::at(const std::string& path) const {
  return root / fs::path(path).relative_path();
}

std::optional<std::string> Machine::text(const std::string& path) const {
  std::error_code error;
  if (!fs::is_regular_file(at(path), error)) return std::nullopt;  // a pipe would make us wait
  std::ifstream in(at(path), std::ios::binary);
  std::string all(kMaxText, '\0');
  if (!in.read(all.data(), static_cast<std::streamsize>(all.size())) && !in.eof())
    return std::nullopt;
  all.resize(static_cast<std::size_t>(in.gcount()));
  return all;
}

std::optional<std::string> Machine::line(const std::string& path) const {
  const std::optional<std::string> all = text(path);
  if (!all) return std::nullopt;
  std::string first(trimmed(std::string_view(*all).substr(0, all->find('\n'))));
  std::replace_if(
      first.begin(), first.end(), [](unsigned char c) { return c < 0x20 || c >= 0x7f; }, '?');
  return first;
}

std::optional<std::int64_t> Machine::number(const std::string& path, int base) const {
  return whole_number<std::int64_t>(line(path), base);
}

std::vector<std::string> Machine::names(const std::string& path) const {
  std::vector<std::string> all;
  std::error_code error;
  for (fs::directory_iterator it(at(path), error), end;
       !error && it != end && all.size() < kMaxNames; it.increment(error))
    all.push_back(it->path().filename().string());
  std::sort(all.begin(), all.end());
  return all;
}

bool Machine::exists(const std::string& path) const {
  std::error_code error;
  return fs::exists(at(path), error);
}

std::string Machine::target(const std::string& path) const {
  std::error_code error;
  const fs::path inside = fs::canonical(root, error);
  if (error) return path;
  const fs::path end = fs::canonical(at(path), error).lexically_relative(inside);
  if (error || end.empty() || *end.begin() == "..") return path;
  return (fs::path("/") / end).string();
}

bool Machine::has_capability(unsigned bit) const {
  const std::optional<std::string> status = text("/proc/self/status");
  if (!status || bit >= 64) return false;
  constexpr std::string_view kKey = "CapEff:";
  const auto where = status->find(kKey);
  if (where == std::string::npos) return false;
  const std::string_view rest = std::string_view(*status).substr(where + kKey.size());
  const std::string hex(trimmed(rest.substr(0, rest.find('\n'))));
  return (whole_number<std::uint64_t>(hex, 16).value_or(0) >> bit & 1U) != 0;
}

std::optional<std::int64_t> Machine::limit(const std::string& name) const {
  const std::optional<std::string> limits = text("/proc/self/limits");
  if (!limits) return std::nullopt;
  std::istringstream lines(*limits);
  for (std::string row; std::getline(lines, row);) {
    if (!row.starts_with(name)) continue;
    std::istringstream words(row.substr(name.size()));
    std::string soft;
    words >> soft;
    if (soft == "unlimited") return -1;
    return whole_number<std::int64_t>(soft, 10);
  }
  return std::nullopt;
}

bool Machine::in_group(const std::string& group) const {
  return std::find(groups.begin(), groups.end(), group) != groups.end();
}

}  // namespace vergence::app
