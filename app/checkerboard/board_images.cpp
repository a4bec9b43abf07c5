#include "app/checkerboard/board_images.hpp"

#include <glob.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <set>

#include <fmt/format.h>

#include "app/checkerboard/board_detector.hpp"
#include "app/runtime/errors.hpp"

namespace vergence::app {
namespace {

namespace fs = std::filesystem;

/// The last run of digits in a file's name without zeros in front, which one camera's files may
/// have and another's not: `left08.jpg` → `8`. Empty: there is none.
std::string number_in(const fs::path& file) {
  const std::string stem = file.stem().string();
  std::size_t end = stem.size();
  while (end > 0 && std::isdigit(static_cast<unsigned char>(stem[end - 1])) == 0) --end;
  std::size_t begin = end;
  while (begin > 0 && std::isdigit(static_cast<unsigned char>(stem[begin - 1])) != 0) --begin;
  while (begin + 1 < end && stem[begin] == '0') ++begin;
  return stem.substr(begin, end - begin);
}

/// Shorter numbers are smaller.
struct LessNumber {
  bool operator()(const std::string& a, const std::string& b) const {
    return a.size() != b.size() ? a.size() < b.size() : a < b;
  }
};

using Numbered = std::map<std::string, fs::path, LessNumber>;

/// By number; empty where two files have the same or one has none.
Numbered numbered(const std::vector<fs::path>& files) {
  Numbered by_number;
  for (const fs::path& file : files) {
    const std::string number = number_in(file);
    if (number.empty() || !by_number.emplace(number, file).second) return {};
  }
  return by_number;
}

/// In order of number.
std::vector<fs::path> list_files(const Numbered& numbered) {
  std::vector<fs::path> files;
  for (const auto& [number, file] : numbered) files.push_back(file);
  return files;
}

std::vector<std::vector<fs::path>> by_order(const std::vector<std::vector<fs::path>>& cameras) {
  std::vector<std::vector<fs::path>> views(cameras[0].size());
  for (std::size_t v = 0; v < views.size(); ++v)
    for (const auto& files : cameras) views[v].push_back(files[v]);
  return views;
}

struct Grey {
  std::vector<std::uint8_t> pixels;
  ImageSize size;
};

ImageFileStatus read_grey(const fs::path& file, Grey* grey) {
  std::vector<std::uint8_t> bytes;
  if (const auto status = read_image_file(file, &bytes); status != ImageFileStatus::ok)
    return status;
  if (const auto status = check_image(bytes, &grey->size); status != ImageFileStatus::ok)
    return status;
  const auto width = static_cast<std::size_t>(grey->size.width);
  grey->pixels.resize(width * static_cast<std::size_t>(grey->size.height));
  return decode_grey(bytes, grey->size, grey->pixels.data(), width);
}

}  // namespace

std::vector<fs::path> matching_files(const std::vector<std::string>& patterns,
                                     const std::string& option) {
  std::set<fs::path> files;
  for (const std::string& pattern : patterns) {
    glob_t found{};
    const int status = ::glob(pattern.c_str(), 0, nullptr, &found);
    for (std::size_t i = 0; status == 0 && i < found.gl_pathc; ++i) files.insert(found.gl_pathv[i]);
    ::globfree(&found);
    if (status != 0)
      throw InputError(
          fmt::format("{} \"{}\": no file matches; check the path, and put a pattern in quotes: {} "
                      "\"left*.png\"",
                      option, pattern.substr(0, 200), option));
  }
  std::vector<fs::path> sorted(files.begin(), files.end());
  std::ranges::sort(sorted, [](const fs::path& a, const fs::path& b) {
    return a.filename() != b.filename() ? a.filename() < b.filename() : a < b;
  });
  return sorted;
}

std::vector<std::vector<fs::path>> group_views(const std::vector<std::vector<fs::path>>& cameras,
                                               std::vector<std::string>* remarks) {
  std::vector<Numbered> numbers;
  numbers.reserve(cameras.size());
  for (const auto& files : cameras) numbers.push_back(numbered(files));
  const bool all_numbered =
      std::ranges::none_of(numbers, [](const Numbered& n) { return n.empty(); });
  std::vector<std::vector<fs::path>> views;
  std::vector<fs::path> alone;
  if (all_numbered) {
    for (const auto& [number, file] : numbers[0]) {
      std::vector<fs::path> view;
      for (const Numbered& n : numbers)
        if (const auto other = n.find(number); other != n.end()) view.push_back(other->second);
      if (view.size() == cameras.size())
        views.push_back(view);
      else
        alone.insert(alone.end(), view.begin(), view.end());
    }
    for (std::size_t k = 1; k < numbers.size(); ++k)
      for (const auto& [number, file] : numbers[k])
        if (numbers[0].find(number) == numbers[0].end()) alone.push_back(file);
  }
  const bool same_length = std::ranges::all_of(
      cameras, [&](const auto& files) { return files.size() == cameras[0].size(); });
  if (same_length && (alone.empty() || 2 * views.size() < cameras[0].size())) {
    if (!all_numbered) return by_order(cameras);
    std::vector<std::vector<fs::path>> in_order(numbers.size());
    std::ranges::transform(numbers, in_order.begin(), list_files);
    return by_order(in_order);
  }
  if (views.empty()) {
    std::string counts;
    for (const auto& files : cameras)
      counts += (counts.empty() ? "" : ", ") + std::to_string(files.size());
    throw InputError(
        fmt::format("the cameras have {} images, and the numbers in their names do not show which "
                    "belong together; give the images of a view the same number",
                    counts));
  }
  for (const fs::path& file : alone)
    remarks->push_back(fmt::format(
        "{}: skipped, because not every camera has an image with that number", file.string()));
  return views;
}

BoardImages read_board_images(const std::vector<std::vector<fs::path>>& views,
                              const BoardPattern& board,
                              const std::function<void(std::size_t, std::size_t)>& on_view) {
  const std::size_t cameras = views.empty() ? 0 : views.front().size();
  BoardImages images;
  images.sizes.resize(cameras);
  const bool part_is_enough = board.kind != BoardKind::checkerboard;
  Grey grey;
  for (std::size_t v = 0; v < views.size(); ++v) {
    BoardView view;
    view.name = views[v][0].filename().string();
    std::vector<std::string> without;
    for (std::size_t k = 0; k < cameras; ++k) {
      const fs::path& file = views[v][k];
      if (const auto status = read_grey(file, &grey); status != ImageFileStatus::ok) {
        without.push_back(fmt::format("{} {}", file.string(), to_phrase(status)));
        continue;
      }
      ImageSize& size = images.sizes[k];
      if (size.width == 0) size = grey.size;
      if (grey.size != size)
        throw InputError(
            fmt::format("{}: has {} x {} pixels, the images before it {} x {}; use images of one "
                        "size per camera",
                        file.string(), grey.size.width, grey.size.height, size.width, size.height));
      const ImageView pixels{grey.pixels.data(), size.width, size.height, size.width};
      view.corners[k] = find_board(pixels, board, BoardSearch::thorough, view.corners[0]);
      if (view.corners[k].empty())
        without.push_back(fmt::format("no target with {}{} in {}", board.describe(),
                                      part_is_enough ? ", or too little of it," : "",
                                      file.string()));
    }
    const auto with = std::ranges::count_if(view.corners, [](const auto& c) { return !c.empty(); });
    const bool usable = !view.corners[0].empty() && with >= (cameras > 1 ? 2 : 1);
    for (const std::string& message : without)
      images.remarks.push_back(message + (usable ? ""
                                          : cameras > 1
                                              ? "; the views of the other cameras are skipped, too"
                                              : "; skipped"));
    if (usable) images.views.push_back(std::move(view));
    if (on_view) on_view(v + 1, images.views.size());
  }
  return images;
}

}  // namespace vergence::app
