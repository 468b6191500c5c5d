#include "console/platform/platform.hpp"

#include <fmt/format.h>
#include <sys/statvfs.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <ctime>
#include <fstream>
#include <memory>
#include <optional>

#include "console/platform/arrivals.hpp"
#include "console/platform/store.hpp"
#include "console/server/captured_program.hpp"
#include "console/server/session_files.hpp"
#include "console/server/site.hpp"
#include "console/server/web_server.hpp"
#include "core/atomic_file.hpp"
#include "core/input_error.hpp"
#include "core/regular_file.hpp"
#include "core/shown_text.hpp"

namespace fs = std::filesystem;

namespace tankrig {
namespace {

namespace asio = boost::asio;
using nlohmann::ordered_json;
using namespace std::chrono_literals;

constexpr auto kTick = 100ms;
constexpr std::int64_t kHour_s = 3600;
constexpr std::size_t kLongestName = 60;
constexpr int kMostListed = 200, kMostNew = 30, kMostUploads = 128;  // the last: at a time
constexpr std::uint64_t kMostScoreBytes = 4 << 20;

WebReply said(unsigned status, std::string why, int retry_after_s = 0) {
  WebReply reply{.status = status, .body = std::move(why) + "\n"};
  reply.retry_after_s = retry_after_s;
  return reply;
}

WebReply json_reply(const ordered_json& json, unsigned status = 200) {
  return {.status = status,
          .type = "application/json",
          .body = json.dump(-1, ' ', false, ordered_json::error_handler_t::replace) + "\n"};
}

class Platform {
 public:
  Platform(asio::io_context& io, const PlatformOptions& options)
      : io_(io),
        options_(options),
        store_(options.store),
        server_(io, options.listen, handlers()),
        tick_(io),
        arrivals_(
            io, options.store, [this](const std::string& id) { return store_.place_of(id); },
            [this](Arrivals::Batch batch) { enter(std::move(batch)); }) {
    for (const auto& entry : fs::directory_iterator(options.store))
      if (entry.path().extension() == kUnfinished) fs::remove(entry.path());
  }

  std::string address() const { return server_.address(); }

  void serve(const std::function<bool()>& stop) {
    stop_ = stop;
    tick();
    io_.run();
  }

 private:
  WebHandlers handlers() {
    WebHandlers h;
    h.get = [this](const std::string& path, const auto& reply) { reply(get(path)); };
    h.joined = h.left = [](ClientId) {};
    h.said = [](ClientId, const std::string&) {};
    h.upload = [this](const WebUpload& upload) { return plan(upload); };
    return h;
  }

  void tick() {
    if (stop_()) {
      store_.put_back();
      return io_.stop();
    }
    start_waiting();
    tick_.expires_after(kTick);
    tick_.async_wait([this](boost::system::error_code cancelled) {
      if (!cancelled) tick();
    });
  }

  // Pages and questions.

  WebReply get(const std::string& path) {
    const auto below = [&](std::string_view folder) {
      return path.starts_with(folder) ? std::optional(path.substr(folder.size())) : std::nullopt;
    };
    try {
      if (path == "/" || below("/submissions/")) return page("/platform");
      if (path == "/platform.js" || path == "/console.css") return page(path);
      if (path == "/api/platform") return json_reply(facts());
      if (const auto name = below("/api/datasets/")) return leaderboard(*name);
      if (const auto id = below("/api/submissions/")) return submission(*id);
      if (const auto file = below("/files/")) return session_file(store_.folder() / "submissions", *file);
      if (const auto name = below("/datasets/")) return archive(*name);
    } catch (const InputError& e) {
      return said(500, e.what());
    }
    return said(404, "There is nothing at this address.");
  }

  static WebReply page(const std::string& path) {
    const auto file = site_file(path);
    return file ? WebReply{.type = file->type, .body = std::string(file->text)} : said(404, "There is no page.");
  }

  const Dataset* dataset(const std::string& name) const {
    const auto found = std::ranges::find(options_.datasets, name, &Dataset::name);
    return found == options_.datasets.end() ? nullptr : &*found;
  }

  ordered_json facts() const {
    ordered_json all{{"version", options_.version},
                     {"no_algorithms", options_.no_algorithms},
                     {"waiting", store_.waiting()},
                     {"uploads_per_hour", options_.quota.uploads_per_hour},
                     {"most_cloud_bytes", options_.most_cloud_bytes},
                     {"most_archive_bytes", options_.most_archive_bytes},
                     {"datasets", ordered_json::array()}};
    for (const Dataset& d : options_.datasets) {
      ordered_json one = d.facts;
      one["name"] = d.name;
      one["uses"] = ordered_json::array();
      if (d.laser) one["uses"].push_back("laser");
      if (d.stereo) one["uses"].push_back("stereo");
      one["download"] = "/datasets/" + d.name + ".tar";
      all["datasets"].push_back(one);
    }
    return all;
  }

  static ordered_json summary(const Submission& s) {
    ordered_json out{{"id", s.id},
                     {"name", s.name},
                     {"dataset", s.dataset},
                     {"kind", s.file.starts_with("cloud") ? "cloud" : "algorithm"},
                     {"uses", s.uses},
                     {"user", s.user},
                     {"received_s", s.received_s},
                     {"state", s.state},
                     {"link", "/submissions/" + s.id}};
    if (!s.message.empty()) out["message"] = s.message;
    if (!s.figures.empty()) out["figures"] = ordered_json::parse(s.figures, nullptr, false);
    return out;
  }

  WebReply leaderboard(const std::string& name) const {
    if (!dataset(name)) return said(404, "There is no dataset of this name.");
    ordered_json out{{"dataset", name}, {"best", ordered_json::array()}, {"newest", ordered_json::array()}};
    for (const Submission& s : store_.best(name, kMostListed)) out["best"].push_back(summary(s));
    for (const Submission& s : store_.newest(name, kMostNew)) out["newest"].push_back(summary(s));
    return json_reply(out);
  }

  WebReply submission(const std::string& id) const {
    const auto found = store_.find(id);
    if (!found) return said(404, "There is no submission of this name.");
    ordered_json out = summary(*found);
    if (found->state == "queued") out["before"] = store_.before(id);
    out["files"] = ordered_json::array();
    std::vector<std::string> files;
    for (const auto& entry : fs::directory_iterator(store_.place_of(id)))
      if (entry.is_regular_file() && entry.path().extension() != kUnfinished)
        files.push_back(entry.path().filename().string());
    std::ranges::sort(files);
    for (const std::string& file : files) out["files"].push_back("/files/" + id + "/" + file);
    const fs::path score = store_.place_of(id) / "score.json";
    if (found->state == "done")
      out["score"] = ordered_json::parse(read_regular_file(score, kMostScoreBytes, "a score"), nullptr, false);
    return json_reply(out);
  }

  WebReply archive(const std::string& name) const {
    const Dataset* const d = name.ends_with(".tar") ? dataset(name.substr(0, name.size() - 4)) : nullptr;
    if (!d) return said(404, "There is no dataset of this name.");
    WebReply reply{.type = "application/x-tar"};
    reply.file = open_regular_file(d->archive, UINT64_MAX >> 1, "a dataset");
    reply.download_as = d->name + ".tar";
    return reply;
  }

  // Uploads.

  WebUploadPlan plan(const WebUpload& upload) {
    WebUploadPlan plan;
    try {
      plan.refusal = refusal(upload);
      if (plan.refusal.status != 200) return plan;
      Submission s;
      s.id = Store::new_id();
      s.dataset = upload.query.at("dataset");
      s.name = upload.query.at("name");
      s.uses = value_of(upload, "uses", "laser");
      s.user = upload.user, s.address = upload.address;
      const bool cloud = upload.path == "/api/clouds";
      s.file = cloud ? "cloud.ply" : "algorithm.tar.gz";
      plan.most = cloud ? options_.most_cloud_bytes : options_.most_archive_bytes;
      s.bytes = upload.bytes.value_or(plan.most);
      // The unfinished file lies in the store itself: a folder of a submission is entered, or goes at the next start.
      const auto arriving = std::make_shared<Arriving>(s, store_.folder() / s.id);
      plan.file = arriving->file.descriptor();
      arriving_.push_back(arriving);
      plan.received = [this, arriving](auto reply) { arrived(arriving, std::move(reply)); };
    } catch (const InputError& e) {
      plan.received = {};
      plan.refusal = said(507, last_line(e.what()));
    }
    return plan;
  }

  static std::string value_of(const WebUpload& upload, const char* key, const char* otherwise = "") {
    const auto found = upload.query.find(key);
    return found == upload.query.end() ? otherwise : found->second;
  }

  /// Status 200: none.
  WebReply refusal(const WebUpload& upload) {
    const bool cloud = upload.path == "/api/clouds";
    if (!cloud && upload.path != "/api/algorithms")
      return said(404, "There is nothing to send to here, expected /api/clouds or /api/algorithms.");
    if (!cloud && !options_.no_algorithms.empty())
      return said(503, "Algorithms are refused: " + options_.no_algorithms);
    const Dataset* const d = dataset(value_of(upload, "dataset"));
    if (!d)
      return said(
          400, "dataset: found '" + shown_text(value_of(upload, "dataset")) + "', expected one that is published here");
    const std::string name = value_of(upload, "name"), uses = value_of(upload, "uses", "laser");
    if (name.empty() || name.size() > kLongestName || shown_text(name) != name)
      return said(400, fmt::format("name: found '{}', expected 1 to {} bytes of text", shown_text(name), kLongestName));
    if (uses != "laser" && uses != "stereo")
      return said(400, "uses: found '" + shown_text(uses) + "', expected laser or stereo");
    if (!(uses == "laser" ? d->laser : d->stereo)) return said(400, "uses: this dataset has no pictures for " + uses);
    if (upload.bytes && *upload.bytes == 0) return said(400, "The upload is empty.");
    const std::uint64_t most = cloud ? options_.most_cloud_bytes : options_.most_archive_bytes;
    if (upload.bytes && *upload.bytes > most)
      return said(413, fmt::format("Found {} bytes, expected at most {}.", *upload.bytes, most));
    return over_quota(upload, upload.bytes.value_or(most));
  }

  WebReply over_quota(const WebUpload& upload, std::uint64_t bytes) {
    std::erase_if(arriving_, [](const auto& one) { return one.expired(); });
    if (arriving_.size() >= kMostUploads) return said(503, "Too many uploads at a time.", 5);
    if (store_.waiting() >= options_.most_waiting) return said(503, "The queue is full.", 60);
    std::uint64_t coming = bytes;
    for (const auto& one : arriving_)
      if (const auto other = one.lock(); other && !other->entered) coming += other->submission.bytes;
    struct statvfs disk {};
    if (::statvfs(store_.folder().c_str(), &disk) == 0 &&
        std::uint64_t{disk.f_bavail} * disk.f_frsize < options_.free_bytes + coming)
      return said(507, "The platform's disk is full.");
    const std::int64_t now = std::time(nullptr);
    const auto check = [&](Store::Whose whose, const std::string& name, std::string Submission::*member) {
      Usage used = store_.usage(whose, name, now - kHour_s);
      for (const auto& one : arriving_)
        if (const auto other = one.lock(); other && !other->entered && other->submission.*member == name)
          ++used.uploads, ++used.waiting, used.bytes += other->submission.bytes;
      const char* const who = whose == Store::Whose::kUser ? "user" : "address";
      const Quota& q = options_.quota;
      const int wait = static_cast<int>(std::clamp<std::int64_t>(used.oldest_s + kHour_s - now, 1, kHour_s));
      if (used.uploads >= q.uploads_per_hour)
        return said(
            429,
            fmt::format("This {} has sent {} uploads within an hour, expected at most that.", who, q.uploads_per_hour),
            wait);
      if (used.bytes + bytes > q.bytes_per_hour)
        return said(
            429, fmt::format("This {} has sent as much as it may within an hour, {} MiB.", who, q.bytes_per_hour >> 20),
            wait);
      if (used.waiting >= q.waiting)
        return said(429, fmt::format("This {} has {} submissions waiting, expected at most that.", who, q.waiting), 30);
      return WebReply{};
    };
    if (!upload.user.empty())
      if (const WebReply reply = check(Store::Whose::kUser, upload.user, &Submission::user); reply.status != 200)
        return reply;
    return check(Store::Whose::kAddress, upload.address, &Submission::address);
  }

  /// The whole upload is in its file.
  void arrived(const std::shared_ptr<Arriving>& arriving, SendReply reply) {
    Submission& s = arriving->submission;
    std::string begin(3, '\0');
    std::ifstream(arriving->file.path(), std::ios::binary).read(begin.data(), 3);
    if (s.file == "cloud.ply" && begin != "ply") s.file = "cloud.pcd";
    std::error_code none;
    s.bytes = fs::file_size(arriving->file.path(), none);
    s.received_s = std::time(nullptr);
    arrivals_.bring(arriving, [this, reply = std::move(reply)](const Arrivals::Brought& one) {
      if (!one.why_not.empty() && !stays(one)) return reply(said(507, last_line(one.why_not)));
      ordered_json out = summary(one.upload->submission);
      out["score"] = "/api/submissions/" + one.upload->submission.id;
      reply(json_reply(out, 202));
    });
  }

  /// Whether it is scored though the disk failed it: who is told of a failure has sent nothing.
  bool stays(const Arrivals::Brought& one) {
    const std::string& id = one.upload->submission.id;
    if (!one.upload->entered) return false;
    try {
      if (!store_.withdraw(id)) return true;
    } catch (const InputError& e) {
      fmt::print(stderr, "tankrig: {}\n", printable(e.what()));
      return true;
    }
    std::error_code none;
    fs::remove_all(store_.place_of(id), none);
    return false;
  }

  /// Their files are on the disk: now their rows.
  void enter(Arrivals::Batch batch) {
    std::vector<Submission> rows;
    for (const Arrivals::Brought& one : batch)
      if (one.why_not.empty()) rows.push_back(one.upload->submission);
    std::string why_not;
    try {
      store_.add(rows);
    } catch (const InputError& e) {
      why_not = e.what();
    }
    for (Arrivals::Brought& one : batch) {
      if (one.why_not.empty()) one.why_not = why_not;
      one.upload->entered = one.why_not.empty();
      std::error_code none;
      if (one.upload->entered) continue;
      fs::remove_all(store_.place_of(one.upload->submission.id), none);
      one.done(one);
    }
    std::erase_if(batch, [](const Arrivals::Brought& one) { return !one.upload->entered; });
    arrivals_.confirm(std::move(batch));
    start_waiting();
  }

  // The queue.

  void start_waiting() {
    try {
      while (running_ < options_.jobs) {
        const auto next = store_.take();
        if (!next) return;
        start(*next);
      }
    } catch (const InputError& e) {
      fmt::print(stderr, "tankrig: {}\n", printable(e.what()));
    }
  }

  void start(const Submission& s) {
    const Dataset* const d = dataset(s.dataset);
    if (!d) return fail(s, "its dataset is no longer published");
    const fs::path place = store_.place_of(s.id);
    const std::vector<std::string> command{options_.program,   "serve",           "score",
                                           d->session,         place / s.file,    "--to=" + place.string(),
                                           "--uses=" + s.uses, "--name=" + s.name};
    ++running_;
    try {
      capture(
          io_, command, [this, s](const Captured& end) { ended(s, end); }, options_.longest);
    } catch (const InputError& e) {
      --running_;
      fail(s, e.what());
    }
  }

  void ended(Submission s, const Captured& end) {
    --running_;
    if (stop_()) return;  // it may have heard the same Ctrl-C
    try {
      const fs::path place = store_.place_of(s.id);
      if (end.exit_code == 0) {
        const ordered_json score =
            ordered_json::parse(read_regular_file(place / "score.json", kMostScoreBytes, "a score"));
        s.state = "done", s.figures = score.at("figures").dump(), s.rank = score.at("rank");
        store_.finish(s);
      } else {
        std::string why = last_line(end.err);
        for (const std::string& hidden : {place.string() + "/", std::string("tankrig: ")})
          for (std::size_t at; (at = why.find(hidden)) != std::string::npos;) why.erase(at, hidden.size());
        fail(s, why.empty() ? fmt::format("the program that scores it ended with {}", end.exit_code) : why);
      }
    } catch (const std::exception& e) {
      fmt::print(stderr, "tankrig: {}: {}\n", s.id, printable(e.what()));
      fail(s, "its score cannot be read");
    }
    start_waiting();
  }

  void fail(Submission s, const std::string& why) {
    s.state = "failed", s.message = shown_text(why, 300);
    store_.finish(s);
  }

  asio::io_context& io_;
  const PlatformOptions& options_;
  Store store_;
  std::vector<std::weak_ptr<Arriving>> arriving_;
  WebServer server_;
  asio::steady_timer tick_;
  std::function<bool()> stop_;
  int running_ = 0;
  Arrivals arrivals_;
};

}  // namespace

void serve_platform(const PlatformOptions& options, const std::function<void(const std::string& address)>& ready,
                    const std::function<bool()>& stop) {
  asio::io_context io(1);
  Platform platform(io, options);
  ready(platform.address());
  platform.serve(stop);
}

}  // namespace tankrig
