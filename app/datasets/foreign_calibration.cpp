#include "app/datasets/foreign_calibration.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <sstream>
#include <tuple>

#include <yaml-cpp/yaml.h>

#include "app/config/calibration_checks.hpp"
#include "app/datasets/detail/names.hpp"
#include "app/datasets/kitti_calibration.hpp"
#include "app/datasets/ros_camera.hpp"
#include "app/datasets/text_file.hpp"
#include "app/runtime/errors.hpp"
#include "app/runtime/transform_rows.hpp"
#include "core/math/so3.hpp"

namespace vergence::app {
namespace {

// ---- settings files of other programs: their syntax, and the names of a calibration's parts

/// Value of a file and its meaning.
///
/// Intrinsics: `matrix` is 3x3 or fx fy cx cy, `focal` one or two focal lengths, `centre` the
/// principal point, `k1` … `k6`, `p1`, `p2` one coefficient each, `fisheye` 0 or 1. Extrinsics:
/// `rectification` 3x3 and `projection` 3x4 as in ROS, `rotation` (3x3 or a rotation vector) and
/// `translation` of camera 1 from camera 0, `to_previous` X_camera = T X_previous camera,
/// `from_body` X_camera = T X_body, `to_body` X_body = T X_camera, `between` X_camera `index` = T
/// X_other camera, `focal_baseline` the focal length times the baseline. `file` names another file
/// with a camera's intrinsics. kWords has the table.
struct Fact {
  std::string_view part{};
  /// 0 is left; empty if the key does not tell.
  std::optional<int> camera{};
  int index = 0;
  const YamlFile* file = nullptr;
  YAML::Node node{};
  /// Key in the file with its groups, such as `cam0.intrinsics`.
  std::string key{};
};

/// Parts of a calibration, each with the words for it: the last part of a key in lower-case letters
/// and digits, without the words and number of the camera.
constexpr const char* kWords =
    "matrix: k m cm kmat mtx matrix cameramatrix intrinsicmatrix intrinsic intrinsics; "
    "fx: fx mu; fy: fy mv; cx: cx u0; cy: cy v0; "
    "focal: f focal focallength; centre: principalpoint pp; "
    "distortion: d dist distcoeff distcoeffs distcoef distcoefs distortion distortioncoeffs "
    "distortioncoefficients distortionvector distortionparameters coefficients; "
    "camera_model: model modeltype cameramodel cameratype type; "
    "distortion_model: distortionmodel distortiontype; fisheye: fisheye fisheyemodel; "
    "size: size imagesize imgsize imagedimension resolution; "
    "width: width imagewidth imgwidth cols; height: height imageheight imgheight rows; "
    "rectification: rectification rectificationmatrix rrect; "
    "projection: p projection projectionmatrix prect; "
    "rotation: r rot rotation rotationmatrix rmat om rvec rotationvector; "
    "translation: t tran trans trns translation translationvector translationmatrix tvec; "
    "to_previous: tcncnm; from_body: tcamimu tcambody tcb tci; "
    "to_body: timucam tbodycam bodytcam tbs tsc tbc tic; "
    "baseline: baseline b; focal_baseline: bf focalxbaseline; "
    "binning_x: binningx; binning_y: binningy; roi_x: roixoffset; roi_y: roiyoffset; "
    "roi_width: roiwidth; roi_height: roiheight; name: cameraname; file: calib camcalib;";

struct Program {
  // Key at the root; with a final underscore the beginning of one.
  std::string_view key;
  std::string_view name;
  // Required parts; empty if files of the program are never supported.
  std::string_view needs;
};
constexpr std::array kPrograms{
    Program{"value0", "Basalt", ""},
    Program{"cameraData", "DepthAI", ""},
    Program{"LEFT_CAM_", "ZED (its factory file)", ""},
    Program{
        "num_of_cam", "VINS",
        "the files that cam0_calib and cam1_calib name, next to it, body_T_cam0 and body_T_cam1"},
    Program{"projection_parameters", "VINS", "the configuration with body_T_cam0 and body_T_cam1"},
    Program{"Camera.bf", "ORB-SLAM",
            "Camera.width and Camera.height, of raw images LEFT.K, D, R, P and RIGHT.…, too"},
    Program{"Camera.type", "ORB-SLAM3", "Camera1.…, Camera2.… and Stereo.T_c1_c2"},
    Program{"Camera", "stella_vslam", "cols, rows and focal_x_baseline"},
    Program{"T_BS", "EuRoC or Kimera",
            "the files of both cameras, left first, separated by a comma"},
    Program{"projection_matrix", "ROS", "camera_info of both cameras, with P"},
    Program{"cam0", "Kalibr",
            "intrinsics, indented below cam0 and cam1, and T_cn_cnm1 of cam1, or T_cam_imu "
            "(T_imu_cam) of both"}};

/// Splits a key into parts: digits are separate from letters, and a capital inside a word begins a
/// new part.
std::vector<std::string> split_key(std::string_view key) {
  std::vector<std::string> tokens;
  enum { sign, digit, small, capital } before = sign;
  for (const char c : key) {
    const auto kind = c >= '0' && c <= '9'   ? digit
                      : c >= 'a' && c <= 'z' ? small
                      : c >= 'A' && c <= 'Z' ? capital
                                             : sign;
    const bool begins = before == sign || (kind == digit) != (before == digit) ||
                        (kind == capital && before == small);
    if (kind != sign && begins) tokens.emplace_back();
    if (kind != sign) tokens.back().push_back(kind == capital ? static_cast<char>(c | 0x20) : c);
    before = kind;
  }
  return tokens;
}

bool is_number(const std::string& token) { return token[0] >= '0' && token[0] <= '9'; }

/// Camera of a key or group as counted in the file. The token that identifies it is removed.
struct Side {
  std::optional<int> number{};
  // True for left and right, which count from 0.
  bool word = false;
};
Side extract_side(std::vector<std::string>* tokens) {
  const std::size_t n = tokens->size();
  const auto at = [&](std::size_t i) { return tokens->begin() + static_cast<std::ptrdiff_t>(i); };
  for (std::size_t i = 0; i < n; ++i)
    if (const std::string token = (*tokens)[i];
        token == "left" || token == "right" ||
        (n > 1 && i + 1 == n && (token == "l" || token == "r"))) {
      tokens->erase(at(i));
      return {token[0] == 'r' ? 1 : 0, true};
    }
  for (std::size_t i = n; i-- > 0;)
    if (const std::string token = (*tokens)[i]; is_number(token) && token.size() <= 2) {
      tokens->erase(at(i));
      return {std::stoi(token), false};
    }
  return {};
}

std::string joined(const std::vector<std::string>& tokens) {
  return fmt::format("{}", fmt::join(tokens, ""));
}

/// Part that a word stands for; empty for other words.
std::string_view find_part(const std::string& word) {
  static const std::map<std::string, std::string> kParts = [] {
    std::map<std::string, std::string> parts;
    std::istringstream words(kWords);
    std::string part;
    for (std::string next; words >> next;)
      if (next.ends_with(':'))
        part = next.substr(0, next.size() - 1);
      else
        parts[next.substr(0, next.find(';'))] = part;
    return parts;
  }();
  const auto found = kParts.find(word);
  return found == kParts.end() ? std::string_view() : found->second;
}

/// k1 to k6, p1 or p2 of a scalar, whose number is not that of a camera; empty for other keys.
std::string_view find_coefficient(const std::vector<std::string>& tokens) {
  if (tokens.size() < 2) return {};
  constexpr std::array<std::string_view, 8> kNames{"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"};
  const auto at = std::ranges::find(kNames, tokens[tokens.size() - 2] + tokens.back());
  return at == kNames.end() ? std::string_view() : *at;
}

bool is_value(const YAML::Node& node) {
  if (node.IsScalar()) return true;
  if (node.IsMap()) return node["data"] && node["data"].IsSequence();
  return node.IsSequence() && (node.size() == 0 || !node[0].IsMap());
}

class Walk {
 public:
  explicit Walk(const YamlFile& file) : file_(file) {}

  std::vector<Fact> facts() {
    visit(file_.root(), "", {}, 0);
    // Cameras are counted from 0 if one of them is.
    const bool from_one =
        std::ranges::none_of(counted_, [&](std::size_t i) { return facts_[i].camera == 0; });
    for (const std::size_t i : counted_)
      if (from_one) --*facts_[i].camera;
    std::erase_if(facts_,
                  [](const Fact& f) { return f.camera && (*f.camera < 0 || *f.camera > 9); });
    return std::move(facts_);
  }

 private:
  // NOLINTNEXTLINE(misc-no-recursion): down to kDeepest
  void visit(const YAML::Node& node, const std::string& above,
             const std::vector<std::string>& groups, int depth) {
    constexpr int kDeepest = 12;
    if (depth > kDeepest) return;
    if (node.IsSequence()) {
      for (std::size_t i = 0; i < node.size(); ++i) {
        auto inner = groups;
        inner.push_back(std::to_string(i));
        visit(node[i], above + "[" + std::to_string(i) + "]", inner, depth + 1);
      }
      return;
    }
    if (!node.IsMap()) return;
    for (const auto& entry : node) {
      if (!entry.first.IsScalar()) continue;
      const std::string key = entry.first.Scalar();
      const std::string path = above.empty() ? key : above + "." + key;
      if (is_value(entry.second)) {
        add(entry.second, path, groups, key);
      } else {
        auto inner = groups;
        inner.push_back(key);
        visit(entry.second, path, inner, depth + 1);
      }
    }
  }

  void add(const YAML::Node& node, const std::string& path, std::vector<std::string> groups,
           std::string key) {
    if (const std::size_t dot = key.rfind('.'); dot != std::string::npos) {
      groups.push_back(key.substr(0, dot));
      key.erase(0, dot + 1);
    }
    std::vector<std::string> tokens = split_key(key);
    if (tokens.empty()) return;
    Fact fact{.file = &file_};
    fact.node.reset(node);
    fact.key = path;
    Side side;
    if (node.IsScalar()) fact.part = find_coefficient(tokens);
    if (!fact.part.empty()) {
      tokens.resize(tokens.size() - 2);
      side = extract_side(&tokens);
    } else if (!parse_transform(tokens, &fact)) {
      // Numbers in these names are not those of cameras.
      const std::string whole = joined(tokens);
      if (whole == "tcncnm1")
        tokens.pop_back();
      else if (!node.IsScalar() || (whole != "u0" && whole != "v0"))
        side = extract_side(&tokens);
      if (!find_fact(tokens, groups, &side, &fact)) return;
    }
    for (std::size_t i = groups.size(); !side.number && i-- > 0;) {
      std::vector<std::string> group = split_key(groups[i]);
      side = extract_side(&group);
    }
    fact.camera = side.number;
    if (side.number && !side.word && fact.part != "between") counted_.push_back(facts_.size());
    facts_.push_back(std::move(fact));
  }

  /// Parses a transform between two named cameras: `T_c1_c2`, `T_cam1_cam0`, `T_right_left`, `Tlr`.
  static bool parse_transform(const std::vector<std::string>& tokens, Fact* fact) {
    const std::string word = joined(tokens);
    std::vector<int> cameras;
    if (word == "tlr" || word == "trl") cameras = {word[1] == 'r', word[2] == 'r'};
    for (const std::string& token : tokens)
      if (token == "left" || token == "right")
        cameras.push_back(token == "right" ? 1 : 0);
      else if (is_number(token) && token.size() == 1)
        cameras.push_back(token[0] - '0');
    if (fact->node.IsScalar() || (tokens[0] != "t" && word.size() != 3) || cameras.size() != 2 ||
        std::abs(cameras[0] - cameras[1]) != 1)
      return false;
    fact->part = "between";
    fact->index = cameras[0] > cameras[1] ? 1 : 0;
    return true;
  }

  /// Finds the part of a key: `KL` is K of the left camera, `stereo_R` is R.
  static bool find_fact(const std::vector<std::string>& tokens,
                        const std::vector<std::string>& groups, Side* side, Fact* fact) {
    std::string word = joined(tokens);
    fact->part = find_part((!groups.empty() && groups.back() == "roi" ? "roi" : "") + word);
    if (fact->part.empty() && !side->number && (word.ends_with('l') || word.ends_with('r'))) {
      fact->part = find_part(word.substr(0, word.size() - 1));
      if (!fact->part.empty()) *side = {word.back() == 'r' ? 1 : 0, true};
    }
    if (const std::size_t at = word.find("stereo"); fact->part.empty() && at != std::string::npos)
      fact->part = find_part(word.erase(at, std::string_view("stereo").size()));
    return !fact->part.empty();
  }

  const YamlFile& file_;
  std::vector<Fact> facts_;
  // Facts whose camera number counts as the file does.
  std::vector<std::size_t> counted_;
};

bool begins_number(std::string_view word) {
  double ignored = 0;
  return parse_number(word.substr(0, word.find_first_of(" \t")), &ignored);
}

/// Converts a value of another syntax: a number, a list of numbers between blanks, commas or
/// semicolons, or text.
std::string as_yaml(std::string_view value) {
  value = trimmed(value);
  if (value.starts_with('[') || value.starts_with('{')) return std::string(value);
  if (!begins_number(value)) return double_quoted(value);
  if (value.find_first_of(" \t,\n") == std::string_view::npos) return std::string(value);
  std::string text(value), list;
  std::ranges::replace_if(
      text, [](char c) { return c == ',' || c == ';'; }, ' ');
  std::istringstream words(text);
  for (std::string word; words >> word;) list += (list.empty() ? "[" : ", ") + word;
  return list + "]";
}

/// OpenCV's XML: elements become keys, an element with text only its value. `depth`: of nesting, at
/// most as deep as such files are.
// NOLINTNEXTLINE(misc-no-recursion): down to kDeepest
std::string from_xml(std::string_view* rest, std::string_view end, int depth) {
  constexpr int kDeepest = 20;
  std::string map;
  std::string_view text;
  while (!rest->empty()) {
    const std::size_t open = rest->find('<');
    text = map.empty() ? rest->substr(0, open) : text;
    if (open == std::string_view::npos) break;
    const std::size_t close = rest->find('>', open);
    if (close == std::string_view::npos) break;
    const std::string_view tag = rest->substr(open + 1, close - open - 1);
    rest->remove_prefix(close + 1);
    if (tag.starts_with('?') || tag.starts_with('!') || tag.ends_with('/')) continue;
    if (tag.starts_with('/')) {
      if (tag.substr(1) == end) break;
      continue;
    }
    const std::string_view name = tag.substr(0, tag.find_first_of(" \t\r\n"));
    if (depth == kDeepest) break;
    const std::string inner = from_xml(rest, name, depth + 1);
    map += (map.empty() ? "" : ", ") + double_quoted(name) + ": " + inner;
  }
  return map.empty() ? as_yaml(text) : "{" + map + "}";
}

/// Converts an ini: sections become groups; an entry is `key = value`, or a key with its numbers in
/// the next lines.
std::string from_ini(std::string_view text) {
  std::string yaml, indent, key, numbers;
  const auto add = [&](std::string_view name, const std::string& value) {
    yaml.append(indent).append(double_quoted(name)).append(": ").append(value).append("\n");
  };
  const auto finish = [&] {
    if (!key.empty() && !numbers.empty()) add(key, as_yaml(numbers));
    key.clear(), numbers.clear();
  };
  Lines lines(text);
  for (std::string_view line; lines.next(&line);) {
    if (line.starts_with(';')) continue;
    if (begins_number(line)) {
      numbers.append(line).append(" ");
      continue;
    }
    finish();
    if (line.starts_with('[') && line.ends_with(']')) {
      indent.clear();
      add(line.substr(1, line.size() - 2), "");
      indent = "  ";
    } else if (const std::size_t equals = line.find('='); equals != std::string_view::npos) {
      add(trimmed(line.substr(0, equals)), as_yaml(line.substr(equals + 1)));
    } else {
      key = line;
    }
  }
  finish();
  return yaml;
}

bool is_ini(std::string_view text) {
  Lines lines(text);
  std::string_view line;
  return lines.next(&line) && line.starts_with('[') && line.ends_with(']') && line.size() > 2 &&
         !begins_number(line.substr(1)) && line.find_first_of(",{\"") == std::string_view::npos;
}

/// All values whose keys are in the vocabulary, in the order of the file. Keys are compared without
/// case and punctuation; a camera is identified by left and right, l and r, or a number (from 0 or
/// 1) in the key or an enclosing group.
std::vector<Fact> find_facts(const YamlFile& file) { return Walk(file).facts(); }

/// Program of a file, by a key that only its files have; null if unknown.
const Program* find_program(const YamlFile& file) {
  if (file.root().IsMap())
    for (const Program& program : kPrograms)
      for (const auto& entry : file.root())
        if (entry.first.IsScalar() &&
            (entry.first.Scalar() == program.key ||
             (program.key.ends_with('_') && entry.first.Scalar().starts_with(program.key))))
          return &program;
  return nullptr;
}

std::vector<YamlFile> settings_trees(std::string text, const std::string& name) {
  // OpenCV's header and tabs are not valid YAML 1.2. They are replaced by blanks, so that line
  // numbers stay the same.
  if (text.starts_with("\xEF\xBB\xBF")) text.erase(0, 3);
  if (text.starts_with("%YAML"))
    std::fill_n(text.begin(), std::min(text.find('\n'), text.size()), ' ');
  std::ranges::replace(text, '\t', ' ');
  std::string_view rest = text;
  rest.remove_prefix(std::min(rest.find_first_not_of(" \r\n"), rest.size()));
  if (rest.starts_with('<'))
    text = from_xml(&rest, "", 0);
  else if (is_ini(rest))
    text = from_ini(rest);
  if (text.starts_with("---")) text.replace(0, 3, 3, ' ');
  std::vector<YamlFile> trees;
  // The document follows as many line feeds as precede it in the file, so that line numbers are
  // right.
  std::string document;
  constexpr std::size_t kMaxDocuments = 16;
  rest = text;
  for (std::size_t documents = 1;; ++documents) {
    if (documents > kMaxDocuments)
      refuse(name, 0, "has more documents (---) than a calibration has");
    const std::size_t end = std::min(rest.find("\n---"), rest.size());
    document.append(rest.substr(0, end));
    YamlFile tree = YamlFile::parse(document, name);
    if (!tree.root().IsNull()) trees.push_back(std::move(tree));
    if (end == rest.size()) return trees;
    document.assign(static_cast<std::size_t>(std::ranges::count(document, '\n')) + 1, '\n');
    rest.remove_prefix(std::min(rest.find('\n', end + 1), rest.size()));
  }
}

namespace fs = std::filesystem;

// ---- numbers

double number_of(const Fact& fact) { return fact.file->number(fact.node, fact.key); }

[[noreturn]] void fail(const Fact& fact, const std::string& what) {
  fact.file->fail(fact.node, fact.key + what);
}

/// All numbers of a value: a scalar, a list, a list of lists, or `{rows, cols, data}`.
std::vector<double> read_numbers(const Fact& fact) {
  constexpr std::size_t kMax = 64;
  const YAML::Node data = fact.node.IsMap() ? fact.node["data"] : fact.node;
  if (data.IsScalar()) return {fact.file->number(data, fact.key)};
  std::vector<double> values;
  for (const auto& item : data) {
    const auto row = item.IsSequence() ? fact.file->numbers(item, fact.key, 0, kMax)
                                       : std::vector{fact.file->number(item, fact.key)};
    values.insert(values.end(), row.begin(), row.end());
    if (values.size() > kMax) fail(fact, " has too many numbers");
  }
  if (fact.node.IsMap())
    if (const YAML::Node rows = fact.node["rows"], columns = fact.node["cols"]; rows && columns)
      if (fact.file->integer(rows, fact.key + ".rows", 0, 1000) *
              fact.file->integer(columns, fact.key + ".cols", 0, 1000) !=
          static_cast<std::int64_t>(values.size()))
        fail(fact, ".data is not a list of rows x cols numbers");
  return values;
}

std::vector<double> read_numbers(const Fact& fact, std::size_t count, const char* what) {
  auto values = read_numbers(fact);
  if (values.size() != count)
    fail(fact, fmt::format(" has {} numbers; {} is expected", values.size(), what));
  return values;
}

/// Converts a matrix of 3 x 3 numbers, or a rotation vector.
Mat3 to_rotation(const Fact& fact) {
  const auto v = read_numbers(fact);
  if (v.size() == 3) return exp_so3(Vec3(v[0], v[1], v[2]));
  if (v.size() != 9) fail(fact, " is neither a matrix of 3 x 3 numbers nor a rotation vector");
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(v.data());
}

/// Converts a matrix of 4 x 4 numbers, or of 3 x 4 without the last row.
Transform to_transform(const Fact& fact) {
  const auto v = read_numbers(fact);
  if (v.size() != 12 && v.size() != 16) fail(fact, " is not a matrix of 4 x 4 numbers");
  if (v.size() == 16 && (v[12] != 0 || v[13] != 0 || v[14] != 0 || v[15] != 1))
    fail(fact, " does not end with the row 0 0 0 1");
  Transform T = transform_of(v);
  // find_implausible() refuses other matrices.
  if (accept_rotation(T.R)) T.R = normalised(T.R);
  return T;
}

// ---- the parts

bool is_lens(const Fact& fact) {
  return fact.part == "matrix" || fact.part == "fx" || fact.part == "focal";
}

/// Assigns facts without a camera to the camera of their file or document, if at least two of these
/// have intrinsics without a camera.
std::vector<Fact> with_cameras(const std::vector<YamlFile>& files) {
  const auto nameless = [](const std::vector<Fact>& facts) {
    return std::ranges::any_of(facts, [](const Fact& f) { return is_lens(f) && !f.camera; });
  };
  std::vector<std::vector<Fact>> of_files(files.size());
  std::ranges::transform(files, of_files.begin(), find_facts);
  const bool one_each = std::ranges::count_if(of_files, nameless) > 1;
  std::vector<Fact> all;
  int camera = 0;
  for (std::vector<Fact>& facts : of_files) {
    const bool of_camera = one_each && nameless(facts);
    for (Fact& fact : facts) {
      if (of_camera && !fact.camera) fact.camera = camera;
      all.push_back(std::move(fact));
    }
    camera += of_camera ? 1 : 0;
  }
  return all;
}

// ---- lenses

std::string join_names(const std::vector<YamlFile>& files) {
  std::string names;
  for (const YamlFile& file : files)
    if (names.find(file.name()) == std::string::npos)
      names += (names.empty() ? "" : ", ") + file.name();
  return names;
}

[[noreturn]] void fail_missing(const std::vector<YamlFile>& files, const std::string& what) {
  for (const YamlFile& file : files)
    if (const Program* program = find_program(file))
      refuse(join_names(files), 0, "{} is missing; the file is of {}: it needs {}", what,
             program->name, program->needs);
  refuse(join_names(files), 0,
         "{} is missing; supported are calibration.yaml, Kalibr, ROS camera_info, OpenCV (M1 D1 M2 "
         "D2 R T), EuRoC, KITTI, ORB-SLAM, VINS and Kimera",
         what);
}

/// Reads intrinsics and transforms of one calibration.
class RigReader {
 public:
  RigReader(const std::vector<YamlFile>& files, const std::optional<ImageSize>& size,
            const CalibrationUse& use, Remarks* remarks)
      : files_(files), size_(size), use_(use), remarks_(remarks), facts_(with_cameras(files)) {}

  CalibrationFile read() {
    int cameras = 0;
    for (const Fact& fact : facts_)
      if (is_lens(fact) && fact.camera) cameras = std::max(cameras, *fact.camera + 1);
    // A rectified pair has one set of intrinsics and a baseline.
    const bool one_for_both = cameras < 2 && find("fx", 0) != nullptr &&
                              (own("focal_baseline", std::nullopt) != nullptr ||
                               own("baseline", std::nullopt) != nullptr);
    if (one_for_both) {
      cameras = 2;
      // Values of camera 0 apply to both cameras.
      for (Fact& fact : facts_)
        if (fact.camera == 0) fact.camera.reset();
    }
    // The message about an unsupported model is more specific than the one about missing
    // intrinsics, so it comes first.
    for (int k = 0; k < 2; ++k) (void)model(k);
    if (cameras < 2) fail_missing(files_, "the camera matrix of a second camera");
    if (cameras > kMaxCameras)
      refuse(join_names(files_), 0, "has {} cameras; a rig has at most {}", cameras, kMaxCameras);
    RigCalibration& rig = out_.rig;
    rig.cameras = cameras;
    for (int k = 0; k < cameras; ++k) {
      read_lens(k);
      if (const Fact* name = own("name", k))
        out_.names[static_cast<std::size_t>(k)] = name->file->text(name->node, name->key);
    }
    if (use_.length_only && use_.baseline > 0) {
      rig.baseline = use_.baseline;
      make_parallel(&rig);
    } else {
      for (int k = 1; k < cameras; ++k) read_place(k);
    }
    return std::move(out_);
  }

 private:
  [[nodiscard]] const Fact* own(std::string_view part, std::optional<int> camera) const {
    for (const Fact& fact : facts_)
      if (fact.part == part && fact.camera == camera) return &fact;
    return nullptr;
  }
  /// Value of this camera, or else one without a camera.
  [[nodiscard]] const Fact* find(std::string_view part, int camera) const {
    const Fact* fact = own(part, camera);
    return fact != nullptr ? fact : own(part, std::nullopt);
  }
  Intrinsics& lens(int k) { return out_.rig.intrinsics[static_cast<std::size_t>(k)]; }
  Transform& place(int k) { return out_.rig.T_camera_left[static_cast<std::size_t>(k)]; }

  void read_lens(int k) {
    std::array<double, 4> fx_fy_cx_cy{};
    if (const Fact* matrix = find("matrix", k)) {
      const auto v = read_numbers(*matrix);
      if (v.size() == 4)
        std::ranges::copy(v, fx_fy_cx_cy.begin());
      else if (v.size() == 9 && v[1] == 0 && v[3] == 0 && v[6] == 0 && v[7] == 0 && v[8] == 1)
        fx_fy_cx_cy = {v[0], v[4], v[2], v[5]};
      else
        fail(*matrix, " is neither fx fy cx cy nor [fx 0 cx; 0 fy cy; 0 0 1]");
    } else {
      const Fact *focal = find("focal", k), *centre = find("centre", k);
      for (std::size_t i = 0; i < 4; ++i) {
        constexpr std::array<std::string_view, 4> kEach{"fx", "fy", "cx", "cy"};
        if (const Fact* fact = find(kEach[i], k)) {
          fx_fy_cx_cy[i] = number_of(*fact);
          continue;
        }
        const Fact* list = i < 2 ? focal : centre;
        if (list == nullptr) fail_missing(files_, fmt::format("the camera matrix of camera {}", k));
        const auto values = read_numbers(*list);
        if (values.empty() || (values.size() < 2 && list == centre))
          fail(*list, " is not a list of two numbers");
        fx_fy_cx_cy[i] = values[std::min(i % 2, values.size() - 1)];
      }
    }
    std::tie(lens(k).fx, lens(k).fy, lens(k).cx, lens(k).cy) = std::tuple_cat(fx_fy_cx_cy);
    read_distortion(k);
    read_size(k);
  }

  /// Camera model according to the file; empty if it states none. *none is set if the file states
  /// that there is no distortion.
  std::optional<CameraModelKind> model(int k, bool* none = nullptr) const {
    std::optional<CameraModelKind> found;
    // The distortion model counts; `pinhole` is listed next to it.
    for (const std::string_view part : {"camera_model", "distortion_model", "fisheye"}) {
      const Fact* fact = find(part, k);
      if (fact == nullptr || !fact->node.IsScalar()) continue;
      std::string word = fact->file->text(fact->node, fact->key);
      if (part == "fisheye")
        word = fact->file->integer(fact->node, fact->key, 0, 1) == 1 ? "fisheye" : "radtan";
      const auto kind = lens_model(word);
      const bool of_rays = part != "camera_model";
      // A `type` may be that of something else.
      const bool stated = of_rays || fact->key.find("odel") != std::string::npos ||
                          fact->key.find("amera.type") != std::string::npos;
      if (!kind && stated)
        fail(*fact, fmt::format(" is \"{}\"; supported is pinhole with radtan (plumb_bob), "
                                "equidistant (fisheye, Kannala-Brandt) or no distortion",
                                word.substr(0, 60)));
      if (none != nullptr)
        *none = *none || word == "none" || word == "Rectified" || (word.empty() && of_rays);
      if (kind && !(found && word.empty())) found = kind;
    }
    return found;
  }

  void read_distortion(int k) {
    bool none = false;
    const auto stated = model(k, &none);
    const bool equidistant = stated == CameraModelKind::pinhole_equidistant;
    if (equidistant) lens(k).kind = CameraModelKind::pinhole_equidistant;
    if (none) return;
    const Fact* list = find("distortion", k);
    std::vector<double> values;
    if (list != nullptr) {
      values = read_numbers(*list);
    } else {
      // The order is that of radtan. Equidistant models have k1 to k4, or k2 to k5 if the angle
      // itself counts as the first.
      using Names = std::vector<std::string_view>;
      const Names names = !equidistant ? Names{"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"}
                          : find("k1", k) != nullptr ? Names{"k1", "k2", "k3", "k4"}
                                                     : Names{"k2", "k3", "k4", "k5"};
      bool any = false;
      for (const std::string_view name : names) {
        const Fact* fact = find(name, k);
        any = any || fact != nullptr;
        values.push_back(fact == nullptr ? 0 : number_of(*fact));
      }
      if (!any)
        fail_missing(files_, fmt::format("the list of distortion coefficients of camera {}", k));
    }
    if (!stated && values.size() == 4 && k == 0)
      remarks_->push_back(
          join_names(files_) +
          ": four distortion coefficients are read as k1 k2 p1 p2 (radtan); if they are k1 k2 k3 "
          "k4 of cv::fisheye, add the line `fisheye_model: 1`, else `fisheye_model: 0`");
    if (const std::string fault =
            set_ros_distortion(equidistant ? "equidistant" : "radtan", values, &lens(k));
        !fault.empty()) {
      if (list != nullptr) fail(*list, " " + fault);
      refuse(join_names(files_), 0, "the list of distortion coefficients {}", fault);
    }
  }

  void read_size(int k) {
    // In px.
    constexpr double kLargest = 1 << 16;
    const Fact *width = find("width", k), *height = find("height", k), *size = find("size", k);
    if (width == nullptr || height == nullptr) width = size;
    std::vector<double> sides;
    if (width == nullptr && size_)
      sides = {static_cast<double>(size_->width), static_cast<double>(size_->height)};
    else if (width == nullptr)
      refuse(join_names(files_), 0,
             "has no image size (OpenCV's sample writes none); add --size WIDTHxHEIGHT");
    else
      sides = width == size ? read_numbers(*size, 2, "[width, height]")
                            : std::vector{number_of(*width), number_of(*height)};
    for (const double side : sides)
      if (!(side >= 1 && side <= kLargest) || side != std::floor(side))
        fail(*width, " is not an image size; two positive numbers are expected");
    lens(k).width = static_cast<int>(sides[0]), lens(k).height = static_cast<int>(sides[1]);
  }

  // ---- where camera k sits

  void read_place(int k) {
    if (from_previous(k) ||
        (k == 1 && (from_rotation() || from_between() || from_rectification())) || from_body(k) ||
        (k == 1 && from_baseline()))
      return;
    fail_missing(files_,
                 fmt::format("the transform of camera {} from the left one, or P of both,", k));
  }

  bool from_previous(int k) {
    const Fact* step = own("to_previous", k);
    if (step == nullptr) return false;
    place(k) = to_transform(*step) * place(k - 1);
    return true;
  }

  /// Uses R and T of OpenCV.
  bool from_rotation() {
    const Fact *R = own("rotation", std::nullopt), *T = own("translation", std::nullopt);
    if (R == nullptr || T == nullptr) {
      if (R != T && find("projection", 1) == nullptr)
        fail_missing(files_, fmt::format("{} of camera 2 from camera 1", R == nullptr ? "R" : "T"));
      return false;
    }
    place(1).R = to_rotation(*R);
    const auto t = read_numbers(*T, 3, "a vector of 3");
    place(1).t = {t[0], t[1], t[2]};
    return true;
  }

  bool from_between() {
    for (const Fact& fact : facts_)
      if (fact.part == "between") {
        Transform T = to_transform(fact);
        place(1) = fact.index == 1 ? T : T.inverse();
        return true;
      }
    return false;
  }

  /// Uses R and P of both cameras (ROS, ORB-SLAM). If R and T exist, R1, R2, P1 and P2 are not
  /// needed.
  bool from_rectification() {
    std::array<RosCamera, 2> cameras;
    for (int k = 0; k < 2; ++k) {
      RosCamera& camera = cameras[static_cast<std::size_t>(k)];
      const Fact* P = own("projection", k);
      if (P == nullptr) return false;
      const auto p = read_numbers(*P, 12, "a matrix of 3 x 4");
      camera.P = Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(p.data());
      if (!(camera.P(0, 0) > 0 && camera.P(1, 1) > 0)) fail(*P, " has no positive focal lengths");
      camera.lens = lens(k);
      const Fact* R = own("rectification", k);
      if (R == nullptr) R = own("rotation", k);
      if (R != nullptr) {
        camera.R = to_rotation(*R);
        if (camera.R.isZero(0) && is_rectified(camera)) camera.R.setIdentity();
        if (!((camera.R.transpose() * camera.R - Mat3::Identity()).cwiseAbs().maxCoeff() <= 1e-3))
          fail(*R, " is not a rotation");
      }
      apply_camera_crop(k, &camera);
    }
    const Fact* P = own("projection", 1);
    if (const std::string fault = set_ros_rig(cameras[0], cameras[1], &out_.rig); !fault.empty())
      fail(*P, " " + fault + " (" + own("projection", 0)->file->name() + " is the left camera's)");
    return true;
  }

  void apply_camera_crop(int k, RosCamera* camera) {
    RosCrop crop;
    for (const auto& [part, value] : {std::pair{"binning_x", &crop.binning_x},
                                      {"binning_y", &crop.binning_y},
                                      {"roi_x", &crop.x},
                                      {"roi_y", &crop.y},
                                      {"roi_width", &crop.width},
                                      {"roi_height", &crop.height}})
      if (const Fact* fact = own(part, k))
        *value = static_cast<std::uint32_t>(fact->file->integer(fact->node, fact->key, 0, 1 << 20));
    if (std::string remark = apply_crop(crop, size_, camera); !remark.empty())
      remarks_->push_back(join_names(files_) + ": " + remark);
  }

  /// Uses the transforms of both cameras in a body.
  bool from_body(int k) {
    const auto T_body_camera = [this](int camera) -> std::optional<Transform> {
      if (const Fact* fact = own("from_body", camera)) return to_transform(*fact).inverse();
      if (const Fact* fact = own("to_body", camera)) return to_transform(*fact);
      return std::nullopt;
    };
    const auto left = T_body_camera(0), other = T_body_camera(k);
    if (!left || !other) return false;
    place(k) = other->inverse() * *left;
    if (accept_rotation(place(k).R)) place(k).R = normalised(place(k).R);
    return true;
  }

  /// Uses a baseline length, which is all that a rectified pair has.
  bool from_baseline() {
    const Fact *length = own("baseline", std::nullopt),
               *focal = own("focal_baseline", std::nullopt);
    if (length == nullptr && focal == nullptr) return false;
    // If the file also has intrinsics of the raw images, the focal length is that of the rectified
    // ones.
    const Fact* rectified = own("fx", std::nullopt);
    const double fx = rectified != nullptr ? number_of(*rectified) : lens(0).fx;
    const double b = length != nullptr ? number_of(*length) : number_of(*focal) / fx;
    Mat3 R_rectified[2] = {Mat3::Identity(), Mat3::Identity()};
    for (int k = 0; k < 2; ++k)
      if (const Fact* R = own("rotation", k)) R_rectified[k] = to_rotation(*R);
    place(1).R = R_rectified[1].transpose() * R_rectified[0];
    place(1).t = R_rectified[1].transpose() * Vec3(-b, 0, 0);
    return true;
  }

  const std::vector<YamlFile>& files_;
  const std::optional<ImageSize>& size_;
  const CalibrationUse& use_;
  Remarks* remarks_;
  std::vector<Fact> facts_;
  CalibrationFile out_;
};

// ---- files

/// Reads a KITTI text, whose lines are `P0: numbers`; empty if it is another text.
std::optional<RigCalibration> read_kitti_text(const std::string& name, const std::string& text,
                                              const std::optional<ImageSize>& size) {
  Lines lines(text);
  std::string_view line;
  if (!lines.next(&line) || !(line.starts_with("P0") || line.starts_with("P2") ||
                              line.starts_with("calib_time") || line.starts_with("S_00")))
    return std::nullopt;
  const bool colour = line.starts_with("P2");
  return read_kitti_projections(name, {colour ? 2 : 0, colour ? 3 : 1}, size);
}

/// Adds the files that a configuration names, which are next to it.
void add_named_files(std::vector<YamlFile>* files) {
  std::vector<YamlFile> named;
  for (const YamlFile& file : *files)
    for (const Fact& fact : find_facts(file)) {
      if (fact.part != "file" || !fact.node.IsScalar()) continue;
      const fs::path path =
          fs::path(file.name()).parent_path() / fs::path(fact.node.Scalar()).filename();
      for (YamlFile& tree : settings_trees(read_text(path, kLargestYaml), path.string()))
        named.push_back(std::move(tree));
    }
  for (YamlFile& tree : named) files->push_back(std::move(tree));
}

/// Throws InputError if the principal point is in the middle of a half or a quarter of the image:
/// the intrinsics are then those of binned images, but the size is that of the sensor.
void check_binning(const std::string& name, const Intrinsics& lens) {
  // Share of the image.
  constexpr double kNear = 0.12;
  const auto off = [&](double parts) {
    return std::max(std::abs(parts * lens.cx / lens.width - 0.5),
                    std::abs(parts * lens.cy / lens.height - 0.5));
  };
  for (const int parts : {2, 4})
    if (off(1) > 2 * kNear - 0.01 && off(parts) < kNear)
      refuse(name, 0,
             "the size is {}x{}, but the principal point ({:.1f}, {:.1f}) is the centre of {}x{}; "
             "the camera matrix is probably of binned images, so write their size",
             lens.width, lens.height, lens.cx, lens.cy, lens.width / parts, lens.height / parts);
}

/// Files of an argument; a directory stands for its left.yaml and right.yaml, or two files with
/// other usual names. Commas separate files unless one has the whole name.
std::vector<fs::path> split_files(const std::string& text) {
  std::error_code ignored;
  if (const fs::path folder = text; fs::is_directory(folder, ignored)) {
    std::vector<std::string> names;
    for (const fs::path& entry : detail::entries_in(folder))
      if (const std::string ending = detail::lower(entry.extension().string());
          ending == ".yaml" || ending == ".yml")
        names.push_back(entry.filename().string());
    if (const auto pairs = detail::stereo_names(names); pairs.size() == 1)
      return {folder / pairs[0][0], folder / pairs[0][1]};
    return {folder / "left.yaml", folder / "right.yaml"};
  }
  if (fs::exists(text, ignored)) return {text};
  std::vector<fs::path> files;
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) files.emplace_back(part);
  return files.empty() ? std::vector<fs::path>{text} : files;
}

}  // namespace

bool is_own_calibration(const fs::path& file) {
  const auto trees = settings_trees(read_text(file, kLargestYaml), file.string());
  return std::ranges::any_of(trees, [](const YamlFile& tree) {
    const YAML::Node& root = tree.root();
    return root.IsMap() && root["cameras"] && !root["cameras"].IsScalar() &&
           (root["version"] || root["rig"]);
  });
}

CalibrationFile parse_any_calibration(const std::vector<CalibrationText>& texts,
                                      const std::optional<ImageSize>& size, Remarks* remarks,
                                      const CalibrationUse& use) {
  if (texts.empty()) throw InputError("no calibration file is named; pass one");
  CalibrationFile out;
  std::optional<RigCalibration> kitti;
  std::vector<YamlFile> files;
  for (const CalibrationText& text : texts) {
    if ((kitti = read_kitti_text(text.name, text.text, size))) break;
    for (YamlFile& tree : settings_trees(text.text, text.name)) files.push_back(std::move(tree));
  }
  if (kitti) {
    out.rig = *kitti;
  } else {
    if (files.empty()) refuse(texts.front().name, 0, "is empty; pass a calibration");
    for (const YamlFile& file : files) {
      if (!file.root().IsMap())
        refuse(file.name(), 0,
               "is not a calibration: it has no lines `key: value`; pass a calibration.yaml, or a "
               "file of Kalibr, ROS or OpenCV");
      if (const Program* program = find_program(file); program != nullptr && program->needs.empty())
        refuse(file.name(), 0,
               "is of {}, which is not supported; convert it to Kalibr, ROS or OpenCV",
               program->name);
    }
    add_named_files(&files);
    out = RigReader(files, size, use, remarks).read();
  }
  const std::string& name = texts.back().name;
  for (const Intrinsics& lens : out.rig.intrinsics)
    if (lens.width > 0 && lens.height > 0) check_binning(name, lens);
  out.source = "given";
  out.rig.baseline = out.rig.T_camera_left[1].t.norm();
  if (const auto bad = find_implausible(&out.rig))
    refuse(name, 0, "converted to calibration.yaml: {}", bad->message);
  apply_use(use, &out.rig);
  return out;
}

Transform read_body_mount(const fs::path& file) {
  const auto trees = settings_trees(read_text(file, kLargestYaml), file.string());
  for (const YamlFile& tree : trees)
    for (const Fact& fact : find_facts(tree)) {
      if (fact.part != "to_body") continue;
      Transform T = to_transform(fact);
      if (!accept_rotation(T.R)) fail(fact, " is not a rigid transform");
      return T;
    }
  refuse(file, 0, "has no T_BS, the pose of the camera in the body");
}

CalibrationFile read_any_calibration(const std::string& in, const std::optional<ImageSize>& size,
                                     Remarks* remarks, const CalibrationUse& use) {
  std::error_code ignored;
  if (fs::is_regular_file(in, ignored) && is_own_calibration(in)) return read_calibration(in, use);
  std::vector<CalibrationText> texts;
  for (const fs::path& path : split_files(in))
    texts.push_back({path.string(), read_text(path, kLargestYaml)});
  return parse_any_calibration(texts, size, remarks, use);
}

}  // namespace vergence::app
