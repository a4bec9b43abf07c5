#include "drivers/v4l2/media.hpp"

#include <fcntl.h>
#include <linux/media.h>
#include <linux/v4l2-subdev.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <system_error>

#include "drivers/v4l2/node.hpp"
#include "drivers/v4l2/v4l2.hpp"

namespace vergence::v4l2 {
namespace fs = std::filesystem;
namespace {

constexpr int kMostEntities =
    128;  // of a graph, and steps along a chain: a driver may lie, or link in a ring

std::string quoted(const MediaEntity& e, std::uint32_t pad) {
  return "\"" + e.name + "\":" + std::to_string(pad);
}

/// Name of a device node by its number, as the kernel's uevent has it.
std::string node_of(std::uint32_t major, std::uint32_t minor) {
  if (major == 0) return {};
  std::error_code error;
  const fs::path link = fs::read_symlink(
      "/sys/dev/char/" + std::to_string(major) + ":" + std::to_string(minor), error);
  return error ? std::string() : "/dev/" + link.filename().string();
}

std::string pad_format(const std::string& node, std::uint32_t pad) {
  const UniqueFd fd(::open(node.c_str(), O_RDWR | O_CLOEXEC));
  if (!fd.valid()) return {};
  v4l2_subdev_format f{};
  f.which = V4L2_SUBDEV_FORMAT_ACTIVE;
  f.pad = pad;
  if (control(fd.get(), VIDIOC_SUBDEV_G_FMT, &f) != 0) return {};
  std::array<char, 48> text{};
  (void)std::snprintf(text.data(), text.size(), "0x%04x/%ux%u", f.format.code, f.format.width,
                      f.format.height);
  return text.data();
}

const MediaEntity* entity(const MediaGraph& g, std::uint32_t id) {
  const auto it = std::find_if(g.entities.begin(), g.entities.end(),
                               [&](const MediaEntity& e) { return e.id == id; });
  return it == g.entities.end() ? nullptr : &*it;
}

/// The link into an entity that counts: an enabled one before one that is off.
const MediaLink* link_into(const MediaGraph& g, std::uint32_t id) {
  const MediaLink* best = nullptr;
  for (const MediaLink& l : g.links)
    if (l.to == id && (best == nullptr || (l.enabled && !best->enabled))) best = &l;
  return best;
}

std::string format_at(const MediaEntity& e, std::uint32_t pad) {
  return pad < e.pads.size() ? e.pads[pad].format : std::string();
}

}  // namespace

std::string advice(const MediaGraph& graph, const std::string& video) {
  const auto last = std::find_if(graph.entities.begin(), graph.entities.end(),
                                 [&](const MediaEntity& e) { return e.node == video; });
  if (last == graph.entities.end()) return {};
  std::string chain = last->name + " (" + video + ")", mend;
  const MediaEntity* at = &*last;
  int steps = 0;
  for (const MediaLink* l = link_into(graph, at->id); l != nullptr && steps < kMostEntities;
       l = link_into(graph, at->id), ++steps) {
    const MediaEntity* before = entity(graph, l->from);
    if (before == nullptr) break;
    const std::string out = format_at(*before, l->from_pad), in = format_at(*at, l->to_pad);
    chain = before->name + (out.empty() ? "" : " [" + out + "]") +
            (l->enabled ? " → " : " ⇢ (off) ") + chain;
    if (!l->enabled)
      mend += "\n  the link is off: media-ctl -d " + graph.node + " -l '" +
              quoted(*before, l->from_pad) + "->" + quoted(*at, l->to_pad) + "[1]'";
    if (!out.empty() && !in.empty() && out != in)
      mend += "\n  " + quoted(*before, l->from_pad) + " gives " + out + ", " +
              quoted(*at, l->to_pad) + " wants " + in + ": media-ctl -d " + graph.node + " -V '" +
              quoted(*at, l->to_pad) + "[fmt:CODE/WIDTHxHEIGHT]' with those of the former";
    at = before;
  }
  if (steps == 0) return {};
  return graph.node + ": " + chain + mend + "\n  all of it: media-ctl -d " + graph.node + " -p" +
         (at->node.empty() ? ""
                           : "; the sensor's controls: v4l2-ctl -d " + at->node +
                                 " -l, option subdevice: " + at->node);
}

std::optional<MediaGraph> read_graph(const std::string& video) {
  std::error_code error;
  const std::string name = fs::canonical(video, error).filename();
  if (error) return std::nullopt;
  MediaGraph graph;
  for (fs::directory_iterator it(fs::path("/sys/class/video4linux") / name / "device", error), end;
       !error && it != end; it.increment(error))
    if (it->path().filename().string().starts_with("media"))
      graph.node = "/dev/" + it->path().filename().string();
  if (graph.node.empty()) return std::nullopt;
  const UniqueFd fd(::open(graph.node.c_str(), O_RDWR | O_CLOEXEC));
  if (!fd.valid()) return std::nullopt;

  media_entity_desc e{};
  for (int i = 0; i < kMostEntities; ++i) {
    e.id |= MEDIA_ENT_ID_FLAG_NEXT;
    if (control(fd.get(), MEDIA_IOC_ENUM_ENTITIES, &e) != 0) break;
    MediaEntity entity;
    entity.id = e.id;
    entity.name = std::string(e.name, std::find(e.name, e.name + sizeof e.name, '\0'));
    entity.node = node_of(e.dev.major, e.dev.minor);
    std::vector<media_pad_desc> pads(e.pads);
    std::vector<media_link_desc> links(e.links);
    media_links_enum all{};
    all.entity = e.id;
    all.pads = pads.data();
    all.links = links.data();
    if (control(fd.get(), MEDIA_IOC_ENUM_LINKS, &all) == 0) {
      for (const media_pad_desc& p : pads)
        entity.pads.push_back(
            {(p.flags & MEDIA_PAD_FL_SINK) != 0, entity.node.find("v4l-subdev") == std::string::npos
                                                     ? std::string()
                                                     : pad_format(entity.node, p.index)});
      for (const media_link_desc& l : links)
        if (l.source.entity == e.id)
          graph.links.push_back({l.source.entity, l.sink.entity, l.source.index, l.sink.index,
                                 (l.flags & MEDIA_LNK_FL_ENABLED) != 0});
    }
    graph.entities.push_back(std::move(entity));
  }
  return graph;
}

std::string media_advice(const std::string& node) {
  const std::optional<MediaGraph> graph = read_graph(node);
  if (!graph) return {};
  std::error_code error;
  const fs::path real = fs::canonical(node, error);
  // A USB camera's units are entities too, but nothing there is to be set by hand.
  const bool by_hand = std::any_of(
      graph->entities.begin(), graph->entities.end(),
      [](const MediaEntity& e) { return e.node.find("v4l-subdev") != std::string::npos; });
  return by_hand && !error ? advice(*graph, "/dev/" + real.filename().string()) : std::string();
}

}  // namespace vergence::v4l2
