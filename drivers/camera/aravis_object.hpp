// Ownership of GLib objects and errors. For the sources of the Aravis camera only.
#pragma once

#include <arv.h>

#include <memory>
#include <string>

namespace tankrig {

struct Unref {
  void operator()(gpointer object) const noexcept { g_object_unref(object); }
};

template <class T>
using ArvPtr = std::unique_ptr<T, Unref>;

/// Where a GLib call puts its error: `call(..., error)`.
class ArvError {
 public:
  ArvError() = default;
  ~ArvError() { g_clear_error(&error_); }
  ArvError(const ArvError&) = delete;
  ArvError& operator=(const ArvError&) = delete;

  operator GError**() noexcept {  // NOLINT(google-explicit-constructor)
    g_clear_error(&error_);
    return &error_;
  }
  explicit operator bool() noexcept { return error_ != nullptr; }
  std::string message() const { return error_ ? error_->message : ""; }

 private:
  GError* error_ = nullptr;
};

}  // namespace tankrig
