#include "console/server/console.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "console/feed/feed_format.hpp"
#include "console/server/captured_program.hpp"
#include "console/server/control.hpp"
#include "console/server/page_version.hpp"
#include "console/server/roles.hpp"
#include "console/server/session_downloads.hpp"
#include "console/server/session_files.hpp"
#include "console/server/site.hpp"
#include "console/server/terminal_program.hpp"
#include "console/server/web_server.hpp"
#include "core/input_error.hpp"
#include "core/shown_text.hpp"
#include "core/utc.hpp"

namespace tankrig {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;
using nlohmann::ordered_json;
using namespace std::chrono_literals;
using SteadyClock = std::chrono::steady_clock;
using Message = std::shared_ptr<const std::string>;

constexpr auto kTick = 50ms;
constexpr auto kAlive = 250ms;            ///< between two signs of life for the page
constexpr auto kDisk = 2s;                ///< between two looks at it
constexpr auto kHeld = 400ms;             ///< after which a key that is held has been let go
constexpr auto kInterruptAgain = 1100ms;  // sooner, it is the same Ctrl-C to a command
constexpr std::size_t kKeptLog = 64 << 10, kKeptPoints = 24 << 20;
constexpr int kMostQuestions = 4;
constexpr char kTooManyQuestions[] = "Too many questions at a time.";

Message text_of(const ordered_json& message) {
  return std::make_shared<const std::string>(message.dump(-1, ' ', false, ordered_json::error_handler_t::replace));
}

std::string text_at(const ordered_json& message, const char* key) {
  return message.contains(key) && message[key].is_string() ? message[key] : "";
}

WebReply said(unsigned status, std::string why) { return {.status = status, .body = std::move(why) + "\n"}; }

/// A command that runs or has run, and what of it a browser that comes later must know.
struct Run {
  Run(asio::io_context& io, const std::vector<std::string>& command, const OfferedCommand& of)
      : program(command),
        offered(of),
        terminal(io, ::dup(program.terminal())),
        feed(io, ::dup(program.feed())),
        end(io, ::dup(program.end())) {}

  TerminalProgram program;
  const OfferedCommand offered;  // the rig that it is of may change
  asio::posix::stream_descriptor terminal, feed, end;
  std::string began_utc = utc_now();
  std::vector<std::string> words;
  std::optional<int> exit_code;
  bool keys_known = false, hold_to_run = false;  ///< the latter: its own keys must be held
  std::optional<SteadyClock::time_point> held;   ///< when the page said so last
  std::optional<SteadyClock::time_point> interrupted;
  bool stopping = false;
  std::string log;
  std::vector<std::pair<std::string, Message>> newest;  ///< of each kind of the feed's texts, as they came
  std::map<std::string, Message> pictures;
  std::vector<Message> points;
  std::size_t point_bytes = 0;
  std::array<char, 4096> terminal_buffer{};
  std::string feed_buffer = std::string(kMostFeedBytes, '\0');
};

class Console {
 public:
  Console(asio::io_context& io, const ConsoleOptions& options)
      : io_(io),
        options_(options),
        chosen_(options.rigs.at(0)),
        rig_(options.rig(chosen_)),
        server_(io, options.listen,
                {[this](const std::string& path, auto reply) { get(path, std::move(reply)); },
                 [this](ClientId id) { joined(id); }, [this](ClientId id) { left(id); },
                 [this](ClientId id, const std::string& text) { heard(id, text); }}),
        downloads_(io, options.program, options.sessions),
        tick_(io) {}

  std::string address() const { return server_.address(); }

  void serve(const std::function<int()>& stops) {
    tick(stops);
    io_.run();
  }

 private:
  void tick(const std::function<int()>& stops) {
    const int asked = stops();
    if (asked > 0) stop_run();
    if ((asked > 0 && !running()) || asked > 1) return io_.stop();
    const auto now = SteadyClock::now();
    if (running() && run_->held && now - *run_->held > kHeld) {
      run_->held.reset();
      tell_log("The button was let go: stop.\r\n");
      stop_run();
    }
    if (now >= disk_at_) {
      disk_at_ = now + kDisk;
      clients_.send_to_all(disk_message(), false, "disk");
    }
    if (now >= alive_at_) {
      alive_at_ = now + kAlive;
      clients_.send_to_all(text_of({{"is", "alive"}, {"utc", utc_now()}}), false, "alive");
    }
    tick_.expires_after(kTick);
    tick_.async_wait([this, &stops](error_code cancelled) {
      if (!cancelled) tick(stops);
    });
  }

  bool running() const { return run_ && !run_->exit_code; }

  // Pages and questions.

  void get(const std::string& path, SendReply reply) {
    if (path == "/") return reply({.type = site_file(path)->type, .body = page_with_version()});
    if (const auto file = site_file(path)) return reply({.type = file->type, .body = std::string(file->text)});
    if (path.starts_with("/sessions/")) return reply(session_file(options_.sessions, path.substr(10)));
    if (const std::size_t end = path.find('/', 1); end != path.npos)
      if (const auto folder = options_.results.find(path.substr(1, end - 1)); folder != options_.results.end())
        return reply(session_file(folder->second, path.substr(end + 1)));
    if (path.starts_with("/downloads/"))
      return downloads_.get(path.substr(11), running() && run_->offered.moves, std::move(reply));
    if (path.starts_with("/api/"))
      if (const auto question = rig_.questions.find(path.substr(5)); question != rig_.questions.end())
        return ask(question->first, question->second, std::move(reply));
    reply(said(404, "There is nothing at this address."));
  }

  void ask(const std::string& name, const std::vector<std::string>& words, SendReply reply) {
    if (questions_ >= kMostQuestions) return reply(said(503, kTooManyQuestions));
    try {
      put_to_program(words, [this, name, reply, of = chosen_](const Captured& answer) {
        if (of == chosen_) keep(name, answer);
        if (ordered_json::accept(answer.out))
          reply({.type = "application/json", .body = answer.out});
        else
          reply(said(502, last_line(answer.err)));
      });
    } catch (const InputError& e) {
      reply(said(502, e.what()));
    }
  }

  /// Errors: InputError if there are too many questions, or no program; then `done` is not called.
  void put_to_program(const std::vector<std::string>& words, std::function<void(const Captured&)> done) {
    if (questions_ >= kMostQuestions) throw InputError(kTooManyQuestions);
    std::vector<std::string> command{options_.program};
    command.insert(command.end(), words.begin(), words.end());
    capture(io_, command, [this, done = std::move(done)](const Captured& answer) {
      --questions_;
      done(answer);
    });
    ++questions_;
  }

  /// What devices or the machine said last is told to all: nobody has to ask again to see it.
  void keep(const std::string& name, const Captured& answer) {
    if (!options_.kept.contains(name)) return;
    ordered_json message{{"is", "known"}, {"what", name}, {"utc", utc_now()}};
    message["answer"] = ordered_json::parse(answer.out, nullptr, false);
    if (message["answer"].is_discarded()) {
      message["answer"] = nullptr;
      message["failure"] = last_line(answer.err);
    }
    known_[name] = text_of(message);
    clients_.send_to_all(known_[name], false);
  }

  /// Of the disk that sessions lie on; this process needs no device for it.
  Message disk_message() const {
    std::error_code unknown;
    const std::filesystem::space_info space = std::filesystem::space(options_.sessions, unknown);
    ordered_json message{{"is", "disk"}, {"utc", utc_now()}};
    if (!unknown) message["free_bytes"] = space.available, message["bytes"] = space.capacity;
    return text_of(message);
  }

  // Browsers.

  void joined(ClientId id) {
    const BrowserSession& who = clients_.session(id);
    ordered_json hello{{"is", "hello"},      {"page", page_version()},      {"you", id},
                       {"user", who.name()}, {"role", name_of(who.role())}, {"rigs", options_.rigs}};
    hello.update(rig_json(who.role()));
    clients_.send(id, text_of(hello), false);
    browsers_.insert(id);
    tell_control();
    clients_.send(id, disk_message(), false);
    for (const auto& [question, answer] : known_) clients_.send(id, answer, false);
    if (!run_) return;
    clients_.send(id, run_message(), false);
    clients_.send(id, text_of({{"is", "log"}, {"text", run_->log}}), false);
    for (const auto& [kind, message] : run_->newest) clients_.send(id, message, false);
    for (const Message& points : run_->points) clients_.send(id, points, true);
    for (const auto& [camera, picture] : run_->pictures) clients_.send(id, picture, true, "picture " + camera);
  }

  /// All of them: the page shows what its user may not start, too, and which role may.
  ordered_json forms_of(Role role) const {
    ordered_json forms = forms_json(rig_.offered);
    for (ordered_json& form : forms) {
      const std::string act = "run " + form["name"].get<std::string>();
      form["role"] = name_of(least_role(act));
      form["granted"] = may(role, act);
    }
    return forms;
  }

  ordered_json rig_json(Role role) const {
    return {{"chosen", chosen_}, {"rig", rig_.facts}, {"forms", forms_of(role)}};
  }

  void left(ClientId id) {
    browsers_.erase(id);
    if (control_.lose(id) && running() && run_->offered.moves) {
      tell_log("The browser in control is gone: stop.\r\n");
      stop_run();
    }
    tell_control();
  }

  void heard(ClientId id, const std::string& text) {
    const ordered_json message = ordered_json::parse(text, nullptr, false);
    if (!message.is_object()) return refuse(id, "a message that is no JSON object");
    const std::string what = text_at(message, "do");
    if (const std::string lacking = lacks(id, "say " + what); !lacking.empty()) return refuse(id, lacking);
    if (what == "stop") return stop_asked(id);
    if (what == "take") {
      if (!control_.take(id)) refuse(id, "another browser is in control");
      return tell_control();
    }
    if (what == "offer" || what == "release") {
      if (what == "offer") control_.offer(id);
      if (what == "release" && control_.holds(id)) release(id);
      return tell_control();
    }
    if (!control_.holds(id)) return refuse(id, "this browser is not in control");
    const bool starts = what == "start";
    if (starts || (running() && (what == "answer" || what == "hold"))) {
      const std::string command = starts ? text_at(message, "command") : run_->offered.name;
      if (const std::string lacking = lacks(id, "run " + command); !lacking.empty()) return refuse(id, lacking);
    }
    if (starts) return start(id, message);
    if (what == "rig") return choose_rig(id, text_at(message, "name"));
    if (const auto wish = options_.wishes.find(what); wish != options_.wishes.end())
      return grant(id, wish->second, message);
    if (!running()) return refuse(id, "nothing runs");
    if (what == "answer") return answer(id, message);
    if (what == "hold") return hold();
    refuse(id, "a wish that nobody knows");
  }

  /// Empty, or which role this act needs.
  std::string lacks(ClientId id, const std::string& act) const {
    if (may(clients_.session(id).role(), act)) return {};
    return std::string("this needs the role ") + name_of(least_role(act));
  }

  template <class Wish>
  void grant(ClientId id, const Wish& wish, const ordered_json& message) {
    try {
      const Granted granted = wish(message);
      clients_.send(id, text_of({{"is", "granted"}, {"wish", message["do"]}, {"answer", granted.answer}}), false);
      if (granted.question.empty()) return;
      put_to_program(granted.question, [this, id, what = message["do"]](const Captured& said) {
        const ordered_json answer = ordered_json::parse(said.out, nullptr, false);
        if (answer.is_discarded()) return refuse(id, last_line(said.err));
        clients_.send(id, text_of({{"is", "answered"}, {"wish", what}, {"answer", answer}}), false);
      });
    } catch (const std::exception& e) {
      refuse(id, e.what());
    }
  }

  void refuse(ClientId id, const std::string& why) {
    clients_.send(id, text_of({{"is", "refused"}, {"why", why}}), false);
  }

  void release(ClientId id) {
    if (running() && run_->offered.moves)
      refuse(id,
             "a run that moves or shines needs somebody in control: stop it first, or let another browser take over");
    else
      control_.lose(id);
  }

  void tell_control() {
    ordered_json message{{"is", "control"}, {"offered", control_.offered()}, {"browsers", browsers_.size()}};
    message["holder"] = control_.holder() ? ordered_json(*control_.holder()) : ordered_json();
    message["holder_name"] = control_.holder() ? clients_.session(*control_.holder()).name() : "";
    clients_.send_to_all(text_of(message), false);
  }

  // The run.

  Message run_message() const {
    ordered_json message{{"is", "run"},
                         {"command", run_->offered.name},
                         {"title", run_->offered.title},
                         {"words", run_->words},
                         {"moves", run_->offered.moves},
                         {"began_utc", run_->began_utc},
                         {"hold", run_->offered.hold},
                         {"stopping", run_->stopping}};
    message["exit_code"] = run_->exit_code ? ordered_json(*run_->exit_code) : ordered_json();
    return text_of(message);
  }

  void start(ClientId id, const ordered_json& request) {
    if (running()) return refuse(id, run_->offered.title + " still runs");
    try {
      const OfferedCommand& offered = command_of(rig_.offered, request);
      std::vector<std::string> words = words_of(rig_.offered, request);
      std::vector<std::string> command{options_.program};
      command.insert(command.end(), words.begin(), words.end());
      run_ = std::make_shared<Run>(io_, command, offered);
      run_->words = std::move(words);
    } catch (const InputError& e) {
      return refuse(id, e.what());
    }
    clients_.send_to_all(run_message(), false);
    read_terminal(run_);
    read_feed(run_);
    wait_for_end(run_);
  }

  void answer(ClientId id, const ordered_json& message) {
    const std::string text = text_at(message, "text");
    if (text.size() > 1000 || std::ranges::any_of(text, [](unsigned char c) { return c < 0x20 || c == 0x7f; }))
      return refuse(id, "an answer that is no single line");
    run_->program.type(text + "\r");
  }

  /// The button is held. Before the command knows its keys it may still ask, and nothing moves.
  void hold() {
    if (!run_->offered.hold || !run_->keys_known) return;
    run_->held = SteadyClock::now();
    if (run_->hold_to_run) run_->program.type(" ");
  }

  /// A command that holds to run by itself waits for the first key; any other moves from now on.
  void keys(bool hold_to_run) {
    run_->keys_known = true;
    run_->hold_to_run = hold_to_run;
    if (run_->offered.hold && !hold_to_run) run_->held = SteadyClock::now();
  }

  /// Where nothing runs, laser and arm are asked all the same: what moves may have been started elsewhere.
  void stop_asked(ClientId id) {
    if (running())
      stop_run();
    else
      start(id, {{"command", options_.make_safe}});
  }

  /// As Ctrl-C on its terminal; a nervous hand presses once.
  void stop_run() {
    if (!running()) return;
    const auto now = SteadyClock::now();
    if (run_->interrupted && now - *run_->interrupted < kInterruptAgain) return;
    run_->interrupted = now;
    run_->program.interrupt();
    if (!std::exchange(run_->stopping, true)) clients_.send_to_all(run_message(), false);
  }

  void tell_log(const std::string& text) {
    run_->log += text;
    if (run_->log.size() > kKeptLog) run_->log.erase(0, run_->log.size() - kKeptLog / 2);
    clients_.send_to_all(text_of({{"is", "log"}, {"text", text}}), false);
  }

  void read_terminal(const std::shared_ptr<Run>& run) {
    run->terminal.async_read_some(asio::buffer(run->terminal_buffer), [this, run](error_code failure, std::size_t n) {
      if (failure) return;
      if (run == run_) tell_log(std::string(run->terminal_buffer.data(), n));
      read_terminal(run);
    });
  }

  /// One read is one message: the socket keeps them apart.
  void read_feed(const std::shared_ptr<Run>& run) {
    run->feed.async_read_some(asio::buffer(run->feed_buffer), [this, run](error_code failure, std::size_t n) {
      if (failure) return;
      if (run == run_) fed({run->feed_buffer.data(), n});
      read_feed(run);
    });
  }

  void fed(std::string_view message) {
    const auto kind = static_cast<FeedKind>(message.empty() ? '\0' : message.front());
    if (kind == FeedKind::kText) return fed_text(message.substr(1));
    const auto whole = std::make_shared<const std::string>(message);
    if (kind == FeedKind::kPoints) {
      if (run_->point_bytes + message.size() > kKeptPoints) return;
      run_->point_bytes += message.size();
      run_->points.push_back(whole);
      clients_.send_to_all(whole, true);
    } else if (const auto camera = pictured_camera(message)) {
      run_->pictures[std::string(*camera)] = whole;
      clients_.send_to_all(whole, true, "picture " + std::string(*camera));
    }
  }

  void fed_text(std::string_view text) {
    ordered_json said = ordered_json::parse(text, nullptr, false);
    if (!said.is_object() || !said.contains("feed") || !said["feed"].is_string()) return;
    const std::string kind = said["feed"];
    if (kind == "keys") keys(said.contains("hold_to_run") && said["hold_to_run"] == true);
    if (kind == "scene") run_->points.clear(), run_->point_bytes = 0;  // another session of the same run begins
    said["is"] = "feed";
    said["utc"] = utc_now();
    const Message message = text_of(said);
    if (kind != "told") {
      const std::string of = kind == "plot" ? kind + " " + text_at(said, "plot") : kind;
      std::erase_if(run_->newest, [&](const auto& known) { return known.first == of; });
      run_->newest.emplace_back(of, message);
    }
    clients_.send_to_all(message, false, kind == "state" || kind == "progress" ? kind : "");
  }

  void wait_for_end(const std::shared_ptr<Run>& run) {
    run->end.async_wait(asio::posix::stream_descriptor::wait_read, [this, run](error_code failure) {
      if (failure) return;
      run->exit_code = run->program.exit_code();
      if (run != run_) return;
      clients_.send_to_all(run_message(), false);
      if (run->offered.name == options_.calibrates) look_at_rig();
    });
  }

  void look_at_rig() {
    try {
      rig_ = options_.rig(chosen_);
      tell_rig();
    } catch (const InputError& e) {
      tell_log(std::string("the rig: ") + e.what() + "\r\n");
    }
  }

  /// What is known of the other one is forgotten, its last run too.
  void choose_rig(ClientId id, const std::string& name) {
    if (running()) return refuse(id, run_->offered.title + " still runs");
    if (std::ranges::find(options_.rigs, name) == options_.rigs.end())
      return refuse(id, "rig: found '" + shown_text(name) + "', expected one that is offered");
    try {
      rig_ = options_.rig(name);
    } catch (const std::exception& e) {
      return refuse(id, e.what());
    }
    chosen_ = name;
    known_.clear();
    run_.reset();
    tell_rig();
  }

  void tell_rig() {
    for (const ClientId browser : browsers_) {
      ordered_json message{{"is", "rig"}};
      message.update(rig_json(clients_.session(browser).role()));
      clients_.send(browser, text_of(message), false);
    }
  }

  asio::io_context& io_;
  const ConsoleOptions& options_;
  std::string chosen_;  // its name
  ConsoleRig rig_;
  WebServer server_;
  Connections& clients_ = server_.clients();
  SessionDownloads downloads_;
  asio::steady_timer tick_;
  SteadyClock::time_point alive_at_{}, disk_at_{};
  std::map<std::string, Message> known_;  // the last answer to each question that is kept
  Control control_;
  std::shared_ptr<Run> run_;  // the last
  std::set<ClientId> browsers_;
  int questions_ = 0;
};

}  // namespace

void serve_console(const ConsoleOptions& options, const std::function<void(const std::string& address)>& ready,
                   const std::function<int()>& stops) {
  asio::io_context io(1);
  Console console(io, options);
  ready(console.address());
  console.serve(stops);
}

}  // namespace tankrig
