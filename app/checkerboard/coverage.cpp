#include "app/checkerboard/coverage.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <opencv2/calib3d.hpp>

#include "app/checkerboard/board_detector.hpp"

namespace vergence::app {
namespace {

constexpr std::array kPartNames{"top left", "top",         "top right", "left",        "the middle",
                                "right",    "bottom left", "bottom",    "bottom right"};
constexpr std::array kTiltNames{"right", "left", "bottom", "top"};

std::size_t part_of(double share) { return share < 1.0 / 3 ? 0 : share < 2.0 / 3 ? 1 : 2; }

/// "a, b and c".
std::string listed(const std::vector<std::string>& words) {
  if (words.size() < 2) return words.empty() ? "" : words.front();
  const std::vector<std::string> first(words.begin(), words.end() - 1);
  return fmt::format("{} and {}", fmt::join(first, ", "), words.back());
}

/// Mean distance of common corners; infinite if none.
double mean_distance(const BoardCorners& a, const BoardCorners& b) {
  double sum = 0;
  int n = 0;
  for (auto i = a.begin(), j = b.begin(); i != a.end() && j != b.end();) {
    if (i->index == j->index) {
      sum += (i->pixel - j->pixel).norm();
      ++n, ++i, ++j;
    } else if (i->index < j->index) {
      ++i;
    } else {
      ++j;
    }
  }
  return n == 0 ? std::numeric_limits<double>::infinity() : sum / n;
}

}  // namespace

Coverage::Coverage(const BoardPattern& board, std::vector<std::string> names,
                   std::vector<ImageSize> sizes, double focal_px)
    : board_(board),
      names_(std::move(names)),
      sizes_(std::move(sizes)),
      focal_px_(focal_px),
      seen_(sizes_.size()) {}

void Coverage::count(const BoardView& view, std::size_t camera, Seen* seen) const {
  const ImageSize size = sizes_[camera];
  Seen parts{};
  for (const BoardCorner& c : view.corners[camera])
    ++parts[part_of(c.pixel.y() / size.height) * 3 + part_of(c.pixel.x() / size.width)];
  for (std::size_t i = 0; i < kParts; ++i) (*seen)[i] = std::max((*seen)[i], parts[i]);
}

Coverage::Stand Coverage::pose_bin(const BoardView& view) const {
  Stand stand;
  const auto& corners = view.corners[0];
  if (corners.empty()) return stand;
  std::vector<cv::Point3d> object;
  std::vector<cv::Point2d> image;
  Vec2 least = corners.front().pixel, most = least;
  for (const BoardCorner& c : corners) {
    const Vec3 X = board_.corner(c.index);
    object.emplace_back(X.x(), X.y(), X.z());
    image.emplace_back(c.pixel.x(), c.pixel.y());
    least = least.cwiseMin(c.pixel);
    most = most.cwiseMax(c.pixel);
  }
  stand.extent =
      std::max((most.x() - least.x()) / sizes_[0].width, (most.y() - least.y()) / sizes_[0].height);
  if (!determine_a_homography(corners, board_)) return stand;
  const cv::Mat K = (cv::Mat_<double>(3, 3) << focal_px_, 0, 0.5 * (sizes_[0].width - 1), 0,
                     focal_px_, 0.5 * (sizes_[0].height - 1), 0, 0, 1);
  cv::Mat turn, place, R;
  try {
    if (!cv::solvePnP(object, image, K, cv::noArray(), turn, place)) return stand;
  } catch (const cv::Exception&) {
    // The tilts are unknown, for example if the corners lie on a line in the image.
    return stand;
  }
  cv::Rodrigues(turn, R);
  // The board's normal away from the camera: where it leans to the right, the right edge is the
  // nearer one.
  const double along = R.at<double>(2, 2) < 0 ? -1 : 1;
  const double right = std::atan2(along * R.at<double>(0, 2), along * R.at<double>(2, 2));
  const double down = std::atan2(along * R.at<double>(1, 2), along * R.at<double>(2, 2));
  stand.tilted = {right > kTilt, right<-kTilt, down> kTilt, down < -kTilt};
  return stand;
}

void Coverage::add(const BoardView& view) {
  for (std::size_t k = 0; k < seen_.size(); ++k) count(view, k, &seen_[k]);
  const Stand stand = pose_bin(view);
  for (std::size_t i = 0; i < kTilts; ++i) tilted_[i] = tilted_[i] || stand.tilted[i];
  nearest_ = std::max(nearest_, stand.extent);
  farthest_ = std::min(farthest_, stand.extent);
  ++views_;
}

bool Coverage::brings_something(const BoardView& view) const {
  for (std::size_t k = 0; k < seen_.size(); ++k) {
    Seen more = seen_[k];
    count(view, k, &more);
    for (std::size_t i = 0; i < kParts; ++i)
      if (seen_[k][i] < kEnoughCorners && more[i] >= kEnoughCorners) return true;
  }
  const Stand stand = pose_bin(view);
  for (std::size_t i = 0; i < kTilts; ++i)
    if (stand.tilted[i] && !tilted_[i]) return true;
  if (nearest_ < kNearExtent) return stand.extent >= kNearExtent;
  return farthest_ > kFarOfNear * nearest_ && stand.extent <= kFarOfNear * nearest_;
}

std::vector<std::string> Coverage::needs() const {
  std::vector<std::string> needs;
  for (std::size_t k = 0; k < seen_.size(); ++k) {
    std::vector<std::string> parts;
    for (std::size_t i = 0; i < kParts; ++i)
      if (seen_[k][i] < kEnoughCorners) parts.emplace_back(kPartNames[i]);
    if (parts.size() == kParts)
      needs.push_back(names_[k] + ": every part of the image");
    else if (!parts.empty())
      needs.push_back(fmt::format("{}: {}", names_[k], listed(parts)));
  }
  std::vector<std::string> edges;
  for (std::size_t i = 0; i < kTilts; ++i)
    if (!tilted_[i]) edges.emplace_back(kTiltNames[i]);
  if (edges.size() == kTilts)
    needs.emplace_back("tilted, each edge nearer in turn");
  else if (!edges.empty())
    needs.push_back(fmt::format("tilted, the {} {}", listed(edges),
                                edges.size() == 1 ? "edge nearer" : "edges nearer in turn"));
  if (nearest_ < kNearExtent)
    needs.emplace_back("nearer");
  else if (farthest_ > kFarOfNear * nearest_)
    needs.emplace_back("farther");
  if (views_ < kEnoughViews)
    needs.push_back(fmt::format("{} more view{}", kEnoughViews - views_,
                                kEnoughViews - views_ == 1 ? "" : "s"));
  return needs;
}

ViewCollector::ViewCollector(Coverage coverage, double image_width_px)
    : coverage_(std::move(coverage)),
      still_px_(kStillOfWidth * image_width_px),
      elsewhere_px_(kElsewhereOfWidth * image_width_px) {}

bool ViewCollector::still(const BoardView& seen) const {
  for (std::size_t k = 0; k < seen.corners.size(); ++k)
    if (!seen.corners[k].empty() && mean_distance(last_.corners[k], seen.corners[k]) > still_px_)
      return false;
  return true;
}

bool ViewCollector::elsewhere(const BoardView& seen) const {
  return std::ranges::all_of(views_, [&](const BoardView& v) {
    return mean_distance(v.corners[0], seen.corners[0]) > elsewhere_px_;
  });
}

OfferResult ViewCollector::offer(const BoardView& seen) {
  const auto others = std::count_if(seen.corners.begin() + 1, seen.corners.end(),
                                    [](const auto& c) { return !c.empty(); });
  const bool held = still(seen);
  last_ = seen;
  if (seen.corners[0].empty() || others == 0) return OfferResult::not_seen;
  if (!held) return OfferResult::moving;
  if (!coverage_.brings_something(seen) && !(coverage_.views() < kEnoughViews && elsewhere(seen)))
    return OfferResult::nothing_new;
  coverage_.add(seen);
  views_.push_back(seen);
  return OfferResult::accepted;
}

}  // namespace vergence::app
