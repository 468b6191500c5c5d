#include "sim_backends/wire/can_hub.hpp"

#include <fmt/format.h>
#include <linux/can/error.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <deque>
#include <list>
#include <mutex>
#include <thread>
#include <utility>

#include "core/clock.hpp"
#include "core/input_error.hpp"
#include "drivers/can/can_datagram.hpp"
#include "drivers/can/can_timing.hpp"
#include "drivers/can/kernel_stamp.hpp"
#include "drivers/can/owned_descriptor.hpp"
#include "sim_backends/wire/wire_priority.hpp"

namespace tankrig::sim {
namespace {

constexpr int kType = SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC;

OwnedDescriptor listen_at(const std::filesystem::path& path) {
  const std::string name = "unix:" + path.string();
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string& text = path.native();
  if (text.empty() || text.size() >= sizeof address.sun_path)
    throw InputError(fmt::format("{}: found a path of {} bytes, expected 1 to {}: choose a shorter runtime folder",
                                 name, text.size(), sizeof address.sun_path - 1));
  text.copy(address.sun_path, text.size());
  const auto* generic = reinterpret_cast<const sockaddr*>(&address);

  struct stat there {};
  if (::lstat(text.c_str(), &there) == 0) {
    if (!S_ISSOCK(there.st_mode)) throw InputError(name + " exists and is not a socket: remove it or choose another");
    const OwnedDescriptor probe(::socket(AF_UNIX, kType, 0));
    if (::connect(probe.get(), generic, sizeof address) == 0 || errno != ECONNREFUSED)
      throw InputError(name + " is served by another process: stop that one or choose another runtime folder");
    ::unlink(text.c_str());
  }
  OwnedDescriptor fd(::socket(AF_UNIX, kType, 0));
  if (!fd || ::bind(fd.get(), generic, sizeof address) != 0 || ::listen(fd.get(), SOMAXCONN) != 0)
    throw InputError(name + ": cannot serve a CAN bus there: " + std::strerror(errno));
  return fd;
}

can_frame error_frame(canid_t classes, std::uint8_t controller = 0) {
  can_frame frame{};
  frame.can_id = CAN_ERR_FLAG | classes;
  frame.can_dlc = CAN_ERR_DLC;
  frame.data[1] = controller;
  return frame;
}

/// What the wire compares bit by bit: of the same first eleven bits, data before remote and standard before extended.
std::uint64_t arbitration(const can_frame& f) {
  const std::uint64_t remote = f.can_id & CAN_RTR_FLAG ? 1 : 0;
  if (!(f.can_id & CAN_EFF_FLAG)) return std::uint64_t{f.can_id & CAN_SFF_MASK} << 21 | remote << 20;
  const std::uint64_t id = f.can_id & CAN_EFF_MASK;
  return (id >> 18) << 21 | std::uint64_t{3} << 19 | (id & 0x3FFFF) << 1 | remote;
}

}  // namespace

struct CanHub::Impl {
  struct Queued {
    can_frame frame{};
    Stamp sent{};
  };

  struct Node {
    Node(OwnedDescriptor d, const Clock& clock) : fd(std::move(d)), stamps(clock) {}
    OwnedDescriptor fd;
    StampConverter stamps;
    CanNodeReport report;
    std::deque<Queued> queue;
    bool closed = false, off = false, cut = false;
    bool unacknowledged = false;  ///< told that nobody acknowledges
    bool overflow_untold = false;
    std::optional<Stamp> restart;
  };

  struct Flight {
    can_frame frame{};
    int node = 0;
    Stamp end{};
  };

  explicit Impl(const CanHubSettings& s) : settings(s), listener(listen_at(s.path)) {
    wake = OwnedDescriptor(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC));
    if (wake.get() < 0) throw InputError(std::string("CAN hub: eventfd: ") + std::strerror(errno));
    thread = std::thread([this] { serve(); });
  }

  ~Impl() {
    {
      const std::lock_guard lock(mutex);
      stopping = true;
    }
    notify();
    thread.join();
    ::unlink(settings.path.c_str());
  }

  void notify() const { ::eventfd_write(wake.get(), 1); }

  Node* find(int number) {
    for (Node& n : nodes)
      if (n.report.number == number && !n.closed) return &n;
    return nullptr;
  }

  void serve() {
    set_fifo("can-hub", kEmulatedWirePriority);
    ::prctl(PR_SET_TIMERSLACK, 1);
    std::vector<pollfd> polled;
    while (true) {
      std::optional<Stamp> next;
      {
        const std::lock_guard lock(mutex);
        if (stopping) return;
        // Whoever connected before a frame was sent hears it: accept after reading.
        for (Node& n : nodes) read(n);
        accept_all();
        const Stamp now = clock.now();
        for (Node& n : nodes) restart_due(n, now);
        advance(now);
        std::erase_if(nodes, [](const Node& n) { return n.closed && n.queue.empty(); });
        next = next_event();
        polled.assign({{listener.get(), POLLIN, 0}, {wake.get(), POLLIN, 0}});
        // A full node whose program has ended would wake this thread for ever; it is read once it has room.
        for (const Node& n : nodes)
          if (!n.closed && (room(n) || n.report.listens_only))
            polled.push_back({n.fd.get(), static_cast<short>(room(n) ? POLLIN : 0), 0});
      }
      wait(polled, next);
      eventfd_t ignored;
      ::eventfd_read(wake.get(), &ignored);
    }
  }

  void wait(std::vector<pollfd>& polled, std::optional<Stamp> next) const {
    if (!next) {
      ::ppoll(polled.data(), polled.size(), nullptr, nullptr);
      return;
    }
    const std::int64_t ns = std::max<std::int64_t>(0, (*next - clock.now()).count());
    const timespec timeout{ns / 1'000'000'000, ns % 1'000'000'000};
    ::ppoll(polled.data(), polled.size(), &timeout, nullptr);
  }

  std::optional<Stamp> next_event() const {
    std::optional<Stamp> next;
    const auto consider = [&next](Stamp t) { next = next ? std::min(*next, t) : t; };
    if (flight) consider(flight->end);
    for (const Node& n : nodes)
      if (n.restart) consider(*n.restart);
    return next;
  }

  bool room(const Node& n) const { return !n.report.listens_only && std::ssize(n.queue) < settings.send_queue_frames; }

  void accept_all() {
    while (true) {
      OwnedDescriptor fd(::accept4(listener.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
      if (!fd) return;
      const int bytes = settings.receive_queue_bytes;
      enable_reports(fd.get());
      ::setsockopt(fd.get(), SOL_SOCKET, SO_SNDBUF, &bytes, sizeof bytes);
      ucred peer{};
      socklen_t size = sizeof peer;
      ::getsockopt(fd.get(), SOL_SOCKET, SO_PEERCRED, &peer, &size);
      Node& n = nodes.emplace_back(std::move(fd), clock);
      n.report.number = accepted++;
      n.report.process = peer.pid;
      read(n);
    }
  }

  void read(Node& n) {
    while (!n.closed && room(n)) {
      const CanDatagram datagram = receive_datagram(n.fd.get());
      if (datagram.bytes < 0 && (datagram.error == EINTR || datagram.error == ECONNRESET)) continue;
      if (datagram.bytes < 0) return;
      if (datagram.bytes == 0 && at_end(n.fd.get())) {
        end_of(n);
        return;
      }
      take(n, datagram);
    }
    if (!n.closed && n.report.listens_only) end_of(n);
  }

  /// Nothing more comes from the node: it has closed, or only its sending half has.
  static void end_of(Node& n) {
    pollfd p{n.fd.get(), 0, 0};
    ::poll(&p, 1, 0);
    n.report.listens_only = true;
    n.closed = p.revents & (POLLHUP | POLLERR);
  }

  void take(Node& n, const CanDatagram& datagram) {
    can_frame frame{};
    frame.can_id = datagram.frame.can_id;
    frame.can_dlc = std::min<std::uint8_t>(datagram.frame.len, CAN_MAX_DLEN);
    std::copy_n(datagram.frame.data, frame.can_dlc, frame.data);
    if (!datagram.classic()) {
      ++total.malformed;
    } else if (n.off) {
      ++total.discarded;
    } else if (frame.can_id & CAN_ERR_FLAG) {
      deliver(frame, n.report.number);
    } else {
      n.queue.push_back({frame, n.stamps(datagram.wall)});
    }
  }

  void restart_due(Node& n, Stamp now) {
    if (!n.restart || *n.restart > now) return;
    n.restart.reset();
    n.off = false;
    hand(n, error_frame(CAN_ERR_RESTARTED));
  }

  bool acknowledged(const Node& sender) const {
    return !sender.cut && std::any_of(nodes.begin(), nodes.end(), [&sender](const Node& n) {
      return &n != &sender && !n.closed && !n.off && !n.cut && !n.report.listens_only;
    });
  }

  /// Everything that has happened on the wire up to `now`.
  void advance(Stamp now) {
    while (true) {
      if (flight) {
        if (flight->end > now) return;
        land();
      }
      if (!launch()) return;
    }
  }

  /// Puts the next frame on the wire: of those waiting when the wire became free, or else of the first to come.
  bool launch() {
    if (jammed) return false;
    std::optional<Stamp> first;
    for (Node& n : nodes) {
      if (n.queue.empty()) continue;
      if (!acknowledged(n)) {
        if (n.closed) n.queue.clear();
        if (!std::exchange(n.unacknowledged, true))
          hand(n, error_frame(CAN_ERR_ACK | CAN_ERR_CRTL, CAN_ERR_CRTL_TX_PASSIVE));
        continue;
      }
      if (n.unacknowledged) {
        n.unacknowledged = false;
        n.queue.front().sent = clock.now();
        hand(n, error_frame(CAN_ERR_CRTL, CAN_ERR_CRTL_ACTIVE));
      }
      first = first ? std::min(*first, n.queue.front().sent) : n.queue.front().sent;
    }
    if (!first) return false;
    const Stamp start = std::max(free, *first);
    Node* winner = nullptr;
    for (Node& n : nodes) {
      if (n.queue.empty() || n.unacknowledged || n.queue.front().sent > start) continue;
      if (!winner || arbitration(n.queue.front().frame) < arbitration(winner->queue.front().frame)) winner = &n;
    }
    flight = Flight{winner->queue.front().frame, winner->report.number, {}};
    const Duration length = bits_duration(frame_bits(flight->frame), settings.bitrate);
    flight->end = start + length;
    total.busy += length;
    winner->queue.pop_front();
    ++winner->report.sent;
    if (!winner->closed) read(*winner);
    return true;
  }

  void land() {
    free = flight->end;
    ++total.frames;
    const can_frame frame = flight->frame;
    const int sender = flight->node;
    flight.reset();
    deliver(frame, sender);
  }

  void deliver(const can_frame& frame, int sender) {
    for (Node& n : nodes)
      if (n.report.number != sender && !n.closed && !n.off && !n.cut && hand(n, frame)) ++n.report.delivered;
  }

  /// False if the node has no room: it is told of its overflow as soon as it has.
  bool hand(Node& n, const can_frame& frame) {
    const auto put = [&n](const can_frame& f) {
      return ::send(n.fd.get(), &f, sizeof f, MSG_DONTWAIT | MSG_NOSIGNAL) == sizeof f;
    };
    if (n.overflow_untold && put(error_frame(CAN_ERR_CRTL, CAN_ERR_CRTL_RX_OVERFLOW))) n.overflow_untold = false;
    if (!n.overflow_untold && put(frame)) return true;
    if (errno == EAGAIN) {
      ++n.report.overflowed;
      n.overflow_untold = true;
    }
    return false;
  }

  const CanHubSettings settings;
  MonotonicClock clock;
  OwnedDescriptor listener, wake;
  mutable std::mutex mutex;  // guards what follows
  std::list<Node> nodes;
  int accepted = 0;
  std::optional<Flight> flight;
  Stamp free{};  ///< when the wire is, or last became, free
  CanHubReport total;
  bool stopping = false, jammed = false;
  std::thread thread;
};

CanHub::CanHub(const CanHubSettings& settings) : impl_(std::make_unique<Impl>(settings)) {}
CanHub::~CanHub() = default;

void CanHub::inject(const can_frame& frame, int node) {
  const std::lock_guard lock(impl_->mutex);
  impl_->accept_all();
  if (node == kEveryone)
    impl_->deliver(frame, kEveryone);
  else if (Impl::Node* n = impl_->find(node))
    impl_->hand(*n, frame);
}

void CanHub::bus_off(int node, std::optional<Duration> restart) {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->accept_all();
    Impl::Node* n = impl_->find(node);
    if (!n) return;
    n->off = true;
    n->queue.clear();
    impl_->hand(*n, error_frame(CAN_ERR_BUSOFF));
    n->restart.reset();
    if (restart) n->restart = impl_->clock.now() + *restart;
  }
  impl_->notify();
}

void CanHub::jam(bool jammed) {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->jammed = jammed;
  }
  impl_->notify();
}

void CanHub::cut(int node, bool severed) {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->accept_all();
    if (Impl::Node* n = impl_->find(node)) n->cut = severed;
  }
  impl_->notify();
}

CanHubReport CanHub::report() const {
  const std::lock_guard lock(impl_->mutex);
  CanHubReport report = impl_->total;
  for (const Impl::Node& n : impl_->nodes)
    if (!n.closed) report.nodes.push_back(n.report);
  return report;
}

}  // namespace tankrig::sim
