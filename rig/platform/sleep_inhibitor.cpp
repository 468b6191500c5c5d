#include "rig/platform/sleep_inhibitor.hpp"

#include <gio/gio.h>
#include <gio/gunixfdlist.h>

#include <memory>

#include "core/reminder.hpp"

namespace tankrig {
namespace {

constexpr const char* kLocks[] = {"sleep", "handle-lid-switch", "shutdown"};  // of the lid, "sleep" alone has no say

template <auto Free>
struct Freed {
  void operator()(auto* pointer) const noexcept { Free(pointer); }
};
template <class T>
using Object = std::unique_ptr<T, Freed<g_object_unref>>;
using Variant = std::unique_ptr<GVariant, Freed<g_variant_unref>>;
using Text = std::unique_ptr<char, Freed<g_free>>;

/// What a call that failed left behind.
std::string taken(GError* error) {
  if (!error) return "no answer";
  g_dbus_error_strip_remote_error(error);
  std::string message = error->message;
  g_error_free(error);
  return message;
}

Object<GDBusConnection> connect(const std::string& bus, GCancellable* over, std::string& why) {
  GError* error = nullptr;
  const Text system(bus.empty() ? g_dbus_address_get_for_bus_sync(G_BUS_TYPE_SYSTEM, over, &error) : nullptr);
  const char* const address = bus.empty() ? system.get() : bus.c_str();
  constexpr auto kFlags = static_cast<GDBusConnectionFlags>(G_DBUS_CONNECTION_FLAGS_AUTHENTICATION_CLIENT |
                                                            G_DBUS_CONNECTION_FLAGS_MESSAGE_BUS_CONNECTION);
  Object<GDBusConnection> connection(
      address ? g_dbus_connection_new_for_address_sync(address, kFlags, nullptr, over, &error) : nullptr);
  if (!connection) why = taken(error);
  return connection;
}

/// The descriptor that holds the lock; one that is not valid where it was refused.
OwnedDescriptor inhibit(GDBusConnection* connection, const char* what, GCancellable* over, std::string& why) {
  GUnixFDList* list = nullptr;
  GError* error = nullptr;
  const Variant answer(g_dbus_connection_call_with_unix_fd_list_sync(
      connection, "org.freedesktop.login1", "/org/freedesktop/login1", "org.freedesktop.login1.Manager", "Inhibit",
      g_variant_new("(ssss)", what, "tankrig", "a laser may shine, an arm may move", "block"), G_VARIANT_TYPE("(h)"),
      G_DBUS_CALL_FLAGS_NONE, -1, nullptr, &list, over, &error));
  const Object<GUnixFDList> descriptors(list);
  int which = 0;
  if (answer) g_variant_get(answer.get(), "(h)", &which);
  OwnedDescriptor lock(descriptors ? g_unix_fd_list_get(descriptors.get(), which, &error) : -1);
  if (!lock) why = taken(error);
  return lock;
}

}  // namespace

SleepInhibitor::SleepInhibitor(const std::string& bus, Duration patience) {
  const Object<GCancellable> over(g_cancellable_new());
  const Reminder at_its_end(patience, patience, [&] { g_cancellable_cancel(over.get()); });
  const Object<GDBusConnection> connection = connect(bus, over.get(), missing_);
  if (!connection) return;
  for (const char* const what : kLocks) {
    std::string why;
    OwnedDescriptor lock = inhibit(connection.get(), what, over.get(), why);
    if (lock)
      locks_.push_back(std::move(lock));
    else
      missing_ += (missing_.empty() ? "" : "; ") + std::string(what) + ": " + why;
  }
}

Finding suspend_finding(const std::string& bus) {
  const SleepInhibitor inhibitor(bus);
  if (inhibitor.missing().empty())
    return {"suspend", Verdict::kGood, "kept off by logind while anything may move or shine"};
  return {"suspend", Verdict::kUsable, "not kept off: " + inhibitor.missing(),
          "a suspension ends the scan: systemctl mask suspend.target hibernate.target (docs/reference/real_time.md)"};
}

}  // namespace tankrig
