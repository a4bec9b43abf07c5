#include "app/foreign_calibration/vocabulary.hpp"

#include <algorithm>
#include <array>
#include <string_view>

namespace vergence::app {
namespace {

struct Words {
  Part part;
  std::string_view words;
};
/// The last part of a key in small letters without signs, the camera's words and number taken off.
constexpr std::array kWords{
    Words{Part::matrix,
          " k m cm kmat mtx matrix cameramatrix intrinsicmatrix intrinsic intrinsics "},
    Words{Part::fx, " fx mu "},
    Words{Part::fy, " fy mv "},
    Words{Part::cx, " cx u0 "},
    Words{Part::cy, " cy v0 "},
    Words{Part::focal, " f focal focallength "},
    Words{Part::centre, " principalpoint pp "},
    Words{Part::distortion,
          " d dist distcoeff distcoeffs distcoef distcoefs distortion distortioncoeffs "
          "distortioncoefficients distortionvector distortionparameters coefficients "},
    Words{Part::camera_model, " model modeltype cameramodel cameratype type "},
    Words{Part::distortion_model, " distortionmodel distortiontype "},
    Words{Part::fisheye, " fisheye fisheyemodel "},
    Words{Part::size, " size imagesize imgsize imagedimension resolution "},
    Words{Part::width, " width imagewidth imgwidth cols "},
    Words{Part::height, " height imageheight imgheight rows "},
    Words{Part::rectification, " rectification rectificationmatrix rrect "},
    Words{Part::projection, " p projection projectionmatrix prect "},
    Words{Part::rotation, " r rot rotation rotationmatrix rmat om rvec rotationvector "},
    Words{Part::translation, " t tran trans trns translation translationvector tvec "},
    Words{Part::to_previous, " tcncnm "},
    Words{Part::from_body, " tcamimu tcambody tcb tci "},
    Words{Part::to_body, " timucam tbodycam bodytcam tbs tsc tbc tic "},
    Words{Part::baseline, " baseline b "},
    Words{Part::focal_baseline, " bf focalxbaseline "},
    Words{Part::binning_x, " binningx "},
    Words{Part::binning_y, " binningy "},
    Words{Part::roi_x, " xoffset "},
    Words{Part::roi_y, " yoffset "},
    Words{Part::topic, " rostopic "},
    Words{Part::name, " cameraname "},
    Words{Part::file, " calib camcalib "},
    Words{Part::other, " timeshiftcamimu "}};

struct Program {
  std::string_view key;  // at the root, or the beginning of one
  std::string_view sentence;
  bool never = false;  // its files are not read, whatever they hold
};
constexpr std::array kPrograms{
    Program{"value0", "is Basalt's calibration, which is not read; Kalibr's camchain of the rig is",
            true},
    Program{"cameraData", "is DepthAI's calibration; export the rectified pair as ROS camera_info",
            true},
    Program{
        "LEFT_CAM_",
        "is the factory file of a ZED camera, which holds all resolutions; write M1 D1 M2 D2 R T "
        "of yours in OpenCV's names, the baseline in metres",
        true},
    Program{"num_of_cam",
            "is a configuration of VINS: cam0_calib and cam1_calib have to name the cameras' files "
            "beside it, and body_T_cam0, body_T_cam1 to be given"},
    Program{"projection_parameters",
            "is a camera of VINS: give its configuration with body_T_cam0 and body_T_cam1, or both "
            "cameras' files with --from-scratch and --baseline"},
    Program{
        "Camera.bf",
        "is a setting of ORB-SLAM: it needs Camera.width and Camera.height, and for images that "
        "are not rectified LEFT.K, LEFT.D, LEFT.R, LEFT.P and RIGHT.…, or Stereo.T_c1_c2"},
    Program{"Camera1.fx", "is a setting of ORB-SLAM3: it needs Camera2.… and Stereo.T_c1_c2"},
    Program{"Camera.type",
            "is a setting of ORB-SLAM3: it needs Camera1.…, Camera2.… and Stereo.T_c1_c2"},
    Program{"Camera", "is a setting of stella_vslam: it needs cols, rows and focal_x_baseline"},
    Program{"T_BS",
            "is of one camera (EuRoC, Kimera): give both files, left first, with a comma between"},
    Program{"projection_matrix", "is camera_info of ROS: both cameras' are needed, with P"},
    Program{"camera_matrix", "is one camera's: both are needed, and where the right one sits"},
    Program{
        "cam0",
        "is a camchain of Kalibr: it needs T_cn_cnm1 of cam1, or T_cam_imu (T_imu_cam) of both"}};

/// Parts of a key: letters and digits apart, capitals inside a word begin the next.
std::vector<std::string> tokens_of(std::string_view key) {
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

/// Which camera a key or a group is of, as it counts; the token that says so is taken out.
struct Side {
  std::optional<int> number{};
  bool word = false;  // left or right: counted from 0
};
Side take_side(std::vector<std::string>* tokens) {
  const auto take = [&](std::size_t i, int number, bool word) {
    tokens->erase(tokens->begin() + static_cast<std::ptrdiff_t>(i));
    return Side{number, word};
  };
  for (std::size_t i = 0; i < tokens->size(); ++i)
    if ((*tokens)[i] == "left" || (*tokens)[i] == "right")
      return take(i, (*tokens)[i] == "right" ? 1 : 0, true);
  if (tokens->size() > 1 && (tokens->back() == "l" || tokens->back() == "r"))
    return take(tokens->size() - 1, tokens->back() == "r" ? 1 : 0, true);
  for (std::size_t i = tokens->size(); i-- > 0;)
    if (const std::string& token = (*tokens)[i]; is_number(token) && token.size() <= 2)
      return take(i, std::stoi(token), false);
  return {};
}

std::string joined(const std::vector<std::string>& tokens) {
  std::string word;
  for (const std::string& token : tokens) word += token;
  return word;
}

const Words* find_word(const std::string& word) {
  const std::string whole = " " + word + " ";
  return std::find_if(kWords.begin(), kWords.end(), [&](const Words& w) {
    return w.words.find(whole) != std::string_view::npos;
  });
}

/// k1 … k6, p1 and p2 of a scalar: their place in k1 k2 p1 p2 k3 k4 k5 k6.
std::optional<int> coefficient_of(const std::vector<std::string>& tokens) {
  if (tokens.size() < 2) return std::nullopt;
  const std::string word = tokens[tokens.size() - 2] + tokens.back();
  constexpr std::array<std::string_view, 8> kNames{"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"};
  const auto at = std::find(kNames.begin(), kNames.end(), word);
  return at == kNames.end() ? std::nullopt : std::optional(static_cast<int>(at - kNames.begin()));
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
    const bool from_one = std::none_of(counted_.begin(), counted_.end(),
                                       [&](std::size_t i) { return facts_[i].camera == 0; });
    for (const std::size_t i : counted_)
      if (from_one) --*facts_[i].camera;
    std::erase_if(facts_,
                  [](const Fact& f) { return f.camera && (*f.camera < 0 || *f.camera > 9); });
    return std::move(facts_);
  }

 private:
  void visit(const YAML::Node& node, const std::string& above,
             const std::vector<std::string>& groups, int depth) {
    constexpr int kDeepest = 12;
    if (depth > kDeepest) return;
    if (node.IsSequence()) {
      for (std::size_t i = 0; i < node.size(); ++i)
        if (node[i].IsMap() || node[i].IsSequence()) {
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
        take(entry.second, path, groups, key);
      } else {
        auto inner = groups;
        inner.push_back(key);
        visit(entry.second, path, inner, depth + 1);
      }
    }
  }

  void take(const YAML::Node& node, const std::string& path, std::vector<std::string> groups,
            std::string key) {
    if (const std::size_t dot = key.rfind('.'); dot != std::string::npos) {
      groups.push_back(key.substr(0, dot));
      key.erase(0, dot + 1);
    }
    std::vector<std::string> tokens = tokens_of(key);
    if (tokens.empty()) return;
    Fact fact;
    fact.file = &file_;
    fact.node.reset(node);
    fact.key = path;
    Side side;
    const auto coefficient = node.IsScalar() ? coefficient_of(tokens) : std::nullopt;
    if (coefficient) {
      fact.part = Part::coefficient;
      fact.index = *coefficient;
      tokens.resize(tokens.size() - 2);
      side = take_side(&tokens);
    } else if (!take_transform(tokens, &fact)) {
      // Numbers in these names are no camera's.
      const std::string whole = joined(tokens);
      if (whole == "tcncnm1")
        tokens.pop_back();
      else if (!node.IsScalar() || (whole != "u0" && whole != "v0"))
        side = take_side(&tokens);
      if (!look_up(tokens, groups, &side, &fact)) return;
    }
    for (std::size_t i = groups.size(); !side.number && i-- > 0;) {
      std::vector<std::string> group = tokens_of(groups[i]);
      side = take_side(&group);
    }
    fact.camera = side.number;
    if (side.number && !side.word && fact.part != Part::between) counted_.push_back(facts_.size());
    facts_.push_back(std::move(fact));
  }

  /// `T_c1_c2`, `T_cam1_cam0`, `T_right_left`, `Tlr`: between two cameras that the key names.
  static bool take_transform(const std::vector<std::string>& tokens, Fact* fact) {
    if (fact->node.IsScalar()) return false;
    const std::string word = joined(tokens);
    fact->part = Part::between;
    struct Named {
      std::string_view word;
      int to, from;
    };
    constexpr std::array kNamed{Named{"tlr", 0, 1}, Named{"trl", 1, 0}, Named{"trightleft", 1, 0},
                                Named{"tleftright", 0, 1}, Named{"tcameraleft", 1, 0}};
    for (const Named& named : kNamed)
      if (word == named.word) {
        fact->index = named.to, fact->other = named.from;
        return true;
      }
    std::vector<int> numbers;
    for (const std::string& token : tokens)
      if (is_number(token) && token.size() == 1) numbers.push_back(token[0] - '0');
    if (tokens[0] != "t" || numbers.size() != 2) return false;
    const int first = std::min(numbers[0], numbers[1]);
    fact->index = numbers[0] - first, fact->other = numbers[1] - first;
    return std::max(fact->index, fact->other) == 1;
  }

  /// `KL` is K of the left camera, `stereo_R` is R.
  static bool look_up(const std::vector<std::string>& tokens,
                      const std::vector<std::string>& groups, Side* side, Fact* fact) {
    std::string word = joined(tokens);
    auto known = find_word(word);
    if (known == kWords.end() && !side->number && (word.ends_with('l') || word.ends_with('r'))) {
      known = find_word(word.substr(0, word.size() - 1));
      if (known != kWords.end()) *side = {word.back() == 'r' ? 1 : 0, true};
    }
    if (const std::size_t at = word.find("stereo");
        known == kWords.end() && at != std::string::npos)
      known = find_word(word.erase(at, std::string_view("stereo").size()));
    if (known == kWords.end()) return false;
    fact->part = known->part;
    if (!groups.empty() && groups.back() == "roi") {
      if (fact->part == Part::width) fact->part = Part::roi_width;
      if (fact->part == Part::height) fact->part = Part::roi_height;
    }
    return true;
  }

  const YamlFile& file_;
  std::vector<Fact> facts_;
  std::vector<std::size_t> counted_;  // facts whose camera is counted as the file counts
};

}  // namespace

std::vector<Fact> facts_of(const YamlFile& file) { return Walk(file).facts(); }

std::string program_of(const YamlFile& file, bool* never) {
  if (!file.root().IsMap()) return "";
  for (const Program& program : kPrograms)
    for (const auto& entry : file.root())
      if (entry.first.IsScalar() &&
          (entry.first.Scalar() == program.key ||
           (program.key.ends_with('_') && entry.first.Scalar().starts_with(program.key)))) {
        *never = program.never;
        return std::string(program.sentence);
      }
  return "";
}

}  // namespace vergence::app
