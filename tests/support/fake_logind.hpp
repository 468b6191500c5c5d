// A logind on a message bus of a test's own.
#pragma once

#include <fcntl.h>
#include <gio/gio.h>
#include <gio/gunixfdlist.h>
#include <poll.h>
#include <unistd.h>

#include <future>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/temporary_folder.hpp"

namespace tankrig::testing_support {

inline constexpr char kLogindInterfaces[] =
    "<node><interface name='org.freedesktop.DBus'><method name='Hello'><arg type='s' direction='out'/></method>"
    "</interface><interface name='org.freedesktop.login1.Manager'><method name='Inhibit'>"
    "<arg type='s' direction='in'/><arg type='s' direction='in'/><arg type='s' direction='in'/>"
    "<arg type='s' direction='in'/><arg type='h' direction='out'/></method></interface></node>";

/// All that a SleepInhibitor asks for, as FakeLogind::asked() tells it.
inline const std::vector<std::string> kAllInhibitors = {"sleep/tankrig/block", "handle-lid-switch/tankrig/block",
                                                        "shutdown/tankrig/block"};

/// A bus with nobody on it but logind, which refuses the locks it is told to.
/// Threads: owns one.
class FakeLogind {
 public:
  explicit FakeLogind(std::set<std::string> refused = {})
      : refused_(std::move(refused)), context_(g_main_context_new()) {
    std::promise<void> up;
    thread_ = std::thread([this, &up] { serve(up); });
    up.get_future().wait();
  }
  ~FakeLogind() {
    g_main_loop_quit(loop_);
    thread_.join();
    g_main_loop_unref(loop_);
    g_main_context_unref(context_);
    for (const int end : held_) ::close(end);
  }
  FakeLogind(const FakeLogind&) = delete;
  FakeLogind& operator=(const FakeLogind&) = delete;

  const std::string& address() const { return address_; }
  /// "WHAT/WHO/MODE" of each lock that was asked for.
  std::vector<std::string> asked() {
    const std::lock_guard lock(mutex_);
    return asked_;
  }
  /// Locks that their holders have not given back.
  int held() { return count_open(0); }
  /// Returns when there are none.
  void wait_until_given_back() { count_open(-1); }

 private:
  int count_open(int wait_ms) {
    const std::lock_guard lock(mutex_);
    int count = 0;
    for (const int end : held_) {
      pollfd door{end, POLLIN, 0};
      count += ::poll(&door, 1, wait_ms) == 0;
    }
    return count;
  }

  void serve(std::promise<void>& up) {
    g_main_context_push_thread_default(context_);
    loop_ = g_main_loop_new(context_, FALSE);
    char* const guid = g_dbus_generate_guid();
    GDBusServer* const server = g_dbus_server_new_sync(("unix:path=" + (folder_.path() / "bus").string()).c_str(),
                                                       G_DBUS_SERVER_FLAGS_NONE, guid, nullptr, nullptr, nullptr);
    g_free(guid);
    address_ = g_dbus_server_get_client_address(server);
    g_signal_connect(server, "new-connection", G_CALLBACK(greet), this);
    g_dbus_server_start(server);
    up.set_value();
    g_main_loop_run(loop_);
    g_dbus_server_stop(server);
    g_object_unref(server);
    for (GDBusConnection* connection : connections_) g_object_unref(connection);
    g_main_context_pop_thread_default(context_);
  }

  static gboolean greet(GDBusServer*, GDBusConnection* connection, gpointer self) {
    auto* const logind = static_cast<FakeLogind*>(self);
    logind->connections_.push_back(static_cast<GDBusConnection*>(g_object_ref(connection)));
    GDBusNodeInfo* const node = g_dbus_node_info_new_for_xml(kLogindInterfaces, nullptr);
    const GDBusInterfaceVTable calls{call, nullptr, nullptr, {}};
    const char* const paths[] = {"/org/freedesktop/DBus", "/org/freedesktop/login1"};
    for (int i = 0; i < 2; ++i)
      g_dbus_connection_register_object(connection, paths[i], node->interfaces[i], &calls, self, nullptr, nullptr);
    g_dbus_node_info_unref(node);
    return TRUE;
  }

  static void call(GDBusConnection*, const char*, const char*, const char*, const char* method, GVariant* words,
                   GDBusMethodInvocation* invocation, gpointer self) {
    if (std::string(method) == "Hello")
      return g_dbus_method_invocation_return_value(invocation, g_variant_new("(s)", ":1.7"));
    static_cast<FakeLogind*>(self)->inhibit(words, invocation);
  }

  void inhibit(GVariant* words, GDBusMethodInvocation* invocation) {
    const char *what, *who, *why, *mode;
    g_variant_get(words, "(&s&s&s&s)", &what, &who, &why, &mode);
    const std::lock_guard lock(mutex_);
    asked_.push_back(std::string(what) + "/" + who + "/" + mode);
    if (refused_.contains(what))
      return g_dbus_method_invocation_return_dbus_error(invocation, "org.freedesktop.DBus.Error.AccessDenied",
                                                        "Permission denied");
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) return;
    GUnixFDList* const list = g_unix_fd_list_new_from_array(&ends[1], 1);  // takes it
    g_dbus_method_invocation_return_value_with_unix_fd_list(invocation, g_variant_new("(h)", 0), list);
    g_object_unref(list);
    held_.push_back(ends[0]);
  }

  const TemporaryFolder folder_;
  const std::set<std::string> refused_;
  GMainContext* const context_;
  GMainLoop* loop_ = nullptr;
  std::string address_;
  std::vector<GDBusConnection*> connections_;
  std::mutex mutex_;  // guards what follows
  std::vector<std::string> asked_;
  std::vector<int> held_;
  std::thread thread_;
};

}  // namespace tankrig::testing_support
