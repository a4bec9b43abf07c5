#pragma once
#include <optional>
#include <string>
#include <vector>

#include "drivers/gige/detail/glib.hpp"

namespace vergence::gige {

/// What a driver wants of a camera; cameras call it by different names.
enum class Purpose : std::uint8_t {
  exposure,       // µs
  gain,           // dB
  frame_rate,     // Hz
  trigger_delay,  // µs
  serial,
  ptp_enable,
  ptp_status,
  ptp_latch,
  chunk_mode,      // whether frames have chunk data at all
  chunk_exposure,  // in a frame's chunk data; µs
  temperature,     // °C
};

/// The GenICam features of an open camera, with sentences for what it does not have.
///
/// Threads  One caller at a time; each call asks the camera and may take 2.5 s when that is gone.
/// Errors   Setters return false and leave the sentence in last_error().
class Features {
 public:
  explicit Features(ArvDevice* device) : device_(device) {}

  [[nodiscard]] bool has(const std::string& name) const;
  /// The first name that this camera has; null: none.
  [[nodiscard]] const char* find(Purpose purpose) const;

  struct Bounds {
    double least = 0, most = 0, step = 0;
  };
  [[nodiscard]] std::optional<Bounds> bounds(const std::string& name) const;
  [[nodiscard]] std::optional<double> number(const std::string& name) const;
  [[nodiscard]] std::string text(const std::string& name) const;
  [[nodiscard]] std::vector<std::string> choices(const std::string& name) const;

  /// A number of a float or integer feature, rounded to the integer's step; outside its bounds it
  /// is refused. *actual: as read back.
  [[nodiscard]] bool set(const std::string& name, double value, const char* unit, double* actual);
  /// One of the entries of an enumeration.
  [[nodiscard]] bool choose(const std::string& name, const std::string& entry);
  [[nodiscard]] bool switch_on(const std::string& name, bool on);
  [[nodiscard]] bool execute(const std::string& name);
  /// As words, whatever the feature is.
  [[nodiscard]] bool set_text(const std::string& name, const std::string& value);
  /// choose() where the camera has feature and entry; never complains.
  void choose_if_there(const std::string& name, const std::string& entry);

  [[nodiscard]] const std::string& last_error() const noexcept { return last_error_; }

 private:
  [[nodiscard]] bool refuse(std::string sentence) {
    last_error_ = std::move(sentence);
    return false;
  }
  ArvDevice* device_;
  std::string last_error_;
};

}  // namespace vergence::gige
