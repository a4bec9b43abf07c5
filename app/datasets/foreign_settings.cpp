#include "app/datasets/foreign_settings.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <map>
#include <sstream>

#include "app/datasets/text_file.hpp"

namespace vergence::app {
namespace {

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
    Program{"num_of_cam", "VINS",
            "the files beside it that cam0_calib and cam1_calib name, body_T_cam0 and body_T_cam1"},
    Program{"projection_parameters", "VINS", "the configuration with body_T_cam0 and body_T_cam1"},
    Program{"Camera.bf", "ORB-SLAM",
            "Camera.width and Camera.height, of raw images LEFT.K, D, R, P and RIGHT.…, too"},
    Program{"Camera.type", "ORB-SLAM3", "Camera1.…, Camera2.… and Stereo.T_c1_c2"},
    Program{"Camera", "stella_vslam", "cols, rows and focal_x_baseline"},
    Program{"T_BS", "EuRoC or Kimera", "both cameras' files, left first, with a comma between"},
    Program{"projection_matrix", "ROS", "camera_info of both cameras, with P"},
    Program{"cam0", "Kalibr", "T_cn_cnm1 of cam1, or T_cam_imu (T_imu_cam) of both"}};

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
    Fact fact;
    fact.file = &file_;
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

/// Converts numbers separated by blanks, commas or semicolons to a YAML list.
std::string as_list(std::string text) {
  std::ranges::replace_if(
      text, [](char c) { return c == ',' || c == ';'; }, ' ');
  std::istringstream words(text);
  std::string list;
  for (std::string word; words >> word;) list += (list.empty() ? "[" : ", ") + word;
  return list + "]";
}

/// Converts a value of another syntax: a number, a list of numbers, or text.
std::string as_yaml(std::string_view value) {
  value = trimmed(value);
  if (value.starts_with('[') || value.starts_with('{')) return std::string(value);
  const bool several = value.find_first_of(" \t,\n") != std::string_view::npos;
  if (begins_number(value) && several) return as_list(std::string(value));
  return begins_number(value) ? std::string(value) : double_quoted(value);
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

/// OpenCV's header and tabs are not valid YAML 1.2. They are replaced by blanks, so that line
/// numbers stay the same.
void replace_invalid_yaml(std::string* text) {
  if (text->starts_with("\xEF\xBB\xBF")) text->erase(0, 3);
  if (text->starts_with("%YAML"))
    std::fill(text->begin(),
              text->begin() + static_cast<std::ptrdiff_t>(std::min(text->find('\n'), text->size())),
              ' ');
  std::ranges::replace(*text, '\t', ' ');
}

}  // namespace

std::vector<Fact> find_facts(const YamlFile& file) { return Walk(file).facts(); }

std::string find_program(const YamlFile& file, bool* never) {
  if (!file.root().IsMap()) return "";
  for (const Program& program : kPrograms)
    for (const auto& entry : file.root())
      if (entry.first.IsScalar() &&
          (entry.first.Scalar() == program.key ||
           (program.key.ends_with('_') && entry.first.Scalar().starts_with(program.key)))) {
        *never = program.needs.empty();
        return fmt::format("is of {}{}{}", program.name,
                           *never ? ", which is not supported; convert it to Kalibr, ROS or OpenCV"
                                  : ": it needs ",
                           program.needs);
      }
  return "";
}

std::vector<YamlFile> settings_trees(std::string text, const std::string& name) {
  replace_invalid_yaml(&text);
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

}  // namespace vergence::app
