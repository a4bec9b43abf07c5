#pragma once
#include <arv.h>

#include <memory>
#include <string>

/// Owners of GLib objects and memory.
namespace vergence::gige {

struct Unref {
  void operator()(void* object) const noexcept { g_object_unref(object); }
};
template <class T>
using Object = std::unique_ptr<T, Unref>;

struct Free {
  void operator()(void* memory) const noexcept { g_free(memory); }
};
template <class T>
using Memory = std::unique_ptr<T, Free>;

/// Owner of a GError: pass `error.out()` to the function, then test `if (error)`.
class Error {
 public:
  Error() noexcept = default;
  ~Error() { g_clear_error(&error_); }
  Error(const Error&) = delete;
  Error& operator=(const Error&) = delete;

  /// Clears the error before it is set again.
  [[nodiscard]] GError** out() noexcept {
    g_clear_error(&error_);
    return &error_;
  }
  [[nodiscard]] explicit operator bool() const noexcept { return error_ != nullptr; }
  [[nodiscard]] bool is(ArvDeviceError code) const noexcept {
    return error_ != nullptr && g_error_matches(error_, ARV_DEVICE_ERROR, code);
  }
  [[nodiscard]] std::string text() const { return error_ == nullptr ? "" : error_->message; }

 private:
  GError* error_ = nullptr;
};

}  // namespace vergence::gige
