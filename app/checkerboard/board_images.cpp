#include "app/checkerboard/board_images.hpp"

#include <glob.h>

#include <algorithm>
#include <map>
#include <set>

#include "app/checkerboard/board_detector.hpp"
#include "app/runtime/errors.hpp"

namespace vergence::app {
namespace {

namespace fs = std::filesystem;

/// Last run of digits in a file's name, with zeros in front so that numbers sort as text; empty if
/// there is none.
std::string number_in(const fs::path& file) {
  constexpr std::string_view kDigits = "0123456789";
  std::string stem = file.stem().string();
  stem.erase(stem.find_last_of(kDigits) + 1);
  stem.erase(0, stem.find_last_not_of(kDigits) + 1);
  return stem.empty() ? stem : fmt::format("{:0>20}", stem);
}

/// Reads a file into *pixels, without padding.
ImageFileStatus read_grey(const fs::path& file, std::vector<std::uint8_t>* pixels,
                          ImageSize* size) {
  std::vector<std::uint8_t> bytes;
  if (const auto status = read_image_file(file, &bytes); status != ImageFileStatus::ok)
    return status;
  if (const auto status = read_image_size(bytes, size); status != ImageFileStatus::ok)
    return status;
  const auto width = static_cast<std::size_t>(size->width);
  pixels->resize(width * static_cast<std::size_t>(size->height));
  return decode_grey(bytes, *size, pixels->data(), width);
}

}  // namespace

std::vector<fs::path> matching_files(const std::vector<std::string>& patterns,
                                     const std::string& option) {
  std::set<fs::path> files;
  for (const std::string& pattern : patterns) {
    glob_t found{};
    std::error_code ignored;
    const std::string all = fs::is_directory(pattern, ignored) ? pattern + "/*" : pattern;
    const int status = ::glob(all.c_str(), 0, nullptr, &found);
    for (std::size_t i = 0; status == 0 && i < found.gl_pathc; ++i) files.insert(found.gl_pathv[i]);
    ::globfree(&found);
    if (status != 0)
      throw InputError(
          "{} \"{}\": no file matches; check the path, and put a pattern in quotes: {} "
          "\"left*.png\"",
          option, pattern.substr(0, 200), option);
  }
  std::vector<fs::path> sorted(files.begin(), files.end());
  std::ranges::sort(sorted, [](const fs::path& a, const fs::path& b) {
    return a.filename() != b.filename() ? a.filename() < b.filename() : a < b;
  });
  return sorted;
}

std::vector<std::vector<fs::path>> group_views(std::vector<std::vector<fs::path>> cameras,
                                               std::vector<std::string>* remarks) {
  std::map<std::string, std::vector<fs::path>> by_number;
  bool numbered = true;
  for (auto& files : cameras) {
    std::ranges::stable_sort(files, {}, number_in);
    std::set<std::string> own;
    for (const fs::path& file : files) {
      const std::string number = number_in(file);
      numbered = numbered && !number.empty() && own.insert(number).second;
      by_number[number].push_back(file);
    }
  }
  const std::size_t most = cameras[0].size();
  const bool same_length =
      std::ranges::all_of(cameras, [&](const auto& files) { return files.size() == most; });
  std::vector<std::vector<fs::path>> views;
  std::vector<fs::path> alone;
  for (const auto& [number, files] : by_number)
    if (files.size() == cameras.size())
      views.push_back(files);
    else
      alone.insert(alone.end(), files.begin(), files.end());
  if (same_length && (!numbered || 2 * views.size() < most)) {
    views.assign(most, {});
    for (std::size_t v = 0; v < most; ++v)
      for (const auto& files : cameras) views[v].push_back(files[v]);
    return views;
  }
  if (!numbered || views.empty()) {
    std::vector<std::size_t> counts;
    for (const auto& files : cameras) counts.push_back(files.size());
    throw InputError(
        "the cameras have {} images, and the numbers in their names do not show which belong "
        "together; give the images of a view the same number",
        fmt::join(counts, ", "));
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
  std::vector<std::uint8_t> grey;
  ImageSize own;
  for (std::size_t v = 0; v < views.size(); ++v) {
    BoardView view{.name = views[v][0].filename().string()};
    std::vector<std::string> without;
    for (std::size_t k = 0; k < cameras; ++k) {
      const fs::path& file = views[v][k];
      if (const auto status = read_grey(file, &grey, &own); status != ImageFileStatus::ok) {
        without.push_back(fmt::format("{} {}", file.string(), to_phrase(status)));
        continue;
      }
      ImageSize& size = images.sizes[k];
      if (size.width == 0) size = own;
      if (own != size)
        throw InputError(
            "{}: has {} x {} pixels, the images before it {} x {}; use images of one size per "
            "camera",
            file.string(), own.width, own.height, size.width, size.height);
      const ImageView pixels{grey.data(), size.width, size.height, size.width};
      view.corners[k] = find_board(pixels, board, BoardSearch::thorough, view.corners[0]);
      if (view.corners[k].empty())
        without.push_back(fmt::format(
            "no target with {}{} in {}", board.describe(),
            board.kind == BoardKind::checkerboard ? "" : ", or too little of it,", file.string()));
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
