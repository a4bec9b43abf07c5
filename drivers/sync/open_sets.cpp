#include "drivers/sync/open_sets.hpp"

#include <algorithm>
#include <cassert>

namespace vergence {

const OpenSet* OpenSets::find(std::uint64_t number) const noexcept {
  for (const OpenSet& o : slots_)
    if (o.used && o.set.number == number) return &o;
  return nullptr;
}

OpenSet* OpenSets::find(std::uint64_t number) noexcept {
  for (OpenSet& o : slots_)
    if (o.used && o.set.number == number) return &o;
  return nullptr;
}

OpenSet* OpenSets::oldest() noexcept {
  OpenSet* best = nullptr;
  for (OpenSet& o : slots_)
    if (o.used && (best == nullptr || o.set.number < best->set.number)) best = &o;
  return best;
}

OpenSet& OpenSets::open(std::uint64_t number, HostStamp first) noexcept {
  assert(!crowded());
  OpenSet* free = std::find_if(slots_.data(), slots_.data() + slots_.size(),
                               [](const OpenSet& o) { return !o.used; });
  *free = OpenSet{};
  free->used = true;
  free->set.number = number;
  free->first = first;
  ++count_;
  return *free;
}

void OpenSets::close(OpenSet* open) noexcept {
  const std::uint64_t number = open->set.number;
  history_[number % kHistory] = {number, open->set.present, true};
  any_out_ = true;
  last_out_ = number;
  last_time_ = open->images[open->base()].time;
  open->used = false;
  --count_;
}

bool OpenSets::went_out_with(std::uint64_t number, std::size_t camera) const noexcept {
  const OutputSet& set = history_[number % kHistory];
  return set.used && set.number == number && set.present[camera];
}

std::uint64_t OpenSets::first_free() const noexcept {
  std::uint64_t free = any_out_ ? last_out_ + 1 : 0;
  for (const OpenSet& o : slots_)
    if (o.used) free = std::max(free, o.set.number + 1);
  return free;
}

void OpenSets::contradict_suspect(std::size_t camera) noexcept {
  for (OpenSet& o : slots_)
    if (o.used && o.set.present[camera] && o.images[camera].suspect) o.contradicted = true;
}

}  // namespace vergence
