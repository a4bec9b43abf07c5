#include "drivers/gige/gige.hpp"

#include <arpa/inet.h>

#include "drivers/gige/detail/gige_camera.hpp"

namespace vergence::gige {
namespace {

bool is_address(const std::string& text) {
  in_addr ignored{};
  return ::inet_pton(AF_INET, text.c_str(), &ignored) == 1;
}

class GigeDriver final : public CameraDriver {
 public:
  std::vector<DeviceInfo> enumerate() override {
    std::vector<DeviceInfo> all;
    for (Found& f : discover()) all.push_back(std::move(f.info));
    last_error_.clear();
    if (all.empty())
      last_error_ =
          "no GigE camera responds to a broadcast; check that its address is in the network of "
          "this "
          "host and that no firewall blocks it";
    return all;
  }

  std::unique_ptr<CameraDevice> open(std::string_view serial, DeviceStatus* status) override {
    std::string where(serial);
    *status = DeviceStatus::not_found;
    last_error_.clear();
    if (!is_address(where)) {
      where.clear();
      for (const Found& f : discover())
        if (where.empty() && (serial.empty() || f.info.serial == serial)) where = f.info.place;
      if (where.empty()) return nullptr;
    }
    std::unique_ptr<Session> session = Session::open(where, status, &last_error_);
    if (session == nullptr) return nullptr;
    return std::make_unique<GigeCamera>(std::move(session));
  }

  std::string last_error() const override { return last_error_; }

 private:
  std::string last_error_;
};

}  // namespace

std::unique_ptr<CameraDriver> make_driver() { return std::make_unique<GigeDriver>(); }

}  // namespace vergence::gige
