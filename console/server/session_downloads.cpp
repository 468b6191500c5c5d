#include "console/server/session_downloads.hpp"

#include <chrono>
#include <limits>
#include <utility>
#include <vector>

#include "console/server/captured_program.hpp"
#include "console/server/session_files.hpp"
#include "core/atomic_file.hpp"
#include "core/regular_file.hpp"
#include "session/export/session_zip.hpp"

namespace fs = std::filesystem;

namespace tankrig {
namespace {

constexpr int kMostZips = 4, kMostBags = 1;  // at a time
constexpr std::chrono::minutes kLongestExport{10};
constexpr char kBag[] = "-bag";  // ends the name of the folder that it is made in
constexpr int kInPart = 3;       // the program's exit code: something that was recorded is missing

WebReply refused(unsigned status, const std::string& why) {
  return {.status = status, .body = why + "\n", .policy = "default-src 'none'; frame-ancestors 'self'"};
}

/// Counts one more until it is destroyed; nothing if there are enough.
std::shared_ptr<void> one_of(const std::shared_ptr<int>& running, int most) {
  if (*running >= most) return nullptr;
  ++*running;
  return {running.get(), [running](void*) { --*running; }};
}

/// What a server that was killed has left.
void clear(const fs::path& sessions) {
  std::error_code none;
  const auto old = fs::file_time_type::clock::now() - 2 * kLongestExport;
  for (const fs::directory_entry& entry : fs::directory_iterator(sessions, none)) {
    const std::string name = entry.path().filename().string();
    const bool of_a_bag = name.starts_with('.') && name.find(kBag) != std::string::npos && name.ends_with(kUnfinished);
    if (of_a_bag && entry.is_directory(none) && entry.last_write_time(none) < old) fs::remove_all(entry.path(), none);
  }
}

}  // namespace

SessionDownloads::SessionDownloads(boost::asio::io_context& io, std::string program, fs::path sessions)
    : io_(io), program_(std::move(program)), sessions_(std::move(sessions)) {
  clear(sessions_);
}

void SessionDownloads::get(const std::string& path, bool moves, SendReply reply) {
  const fs::path file(path);
  const Session session{file.stem().string(), sessions_ / file.stem()};
  const bool plain = !file.has_parent_path() && !session.name.empty() && !session.name.starts_with('.');
  std::error_code none;
  if (!plain || fs::is_symlink(session.path, none) || !fs::is_directory(session.path, none))
    return reply(refused(404, "There is no such session."));
  if (file.extension() == ".zip") return reply(zip(session));
  if (file.extension() != ".bag") return reply(refused(404, "A session is had as .zip or .bag."));
  if (moves) return reply(refused(503, "A bag is made when nothing moves or shines: ask again after the run."));
  bag(session, std::move(reply));
}

WebReply SessionDownloads::zip(const Session& session) try {
  const auto running = one_of(zips_, kMostZips);
  if (!running) return refused(503, "Others download as many sessions as may be sent at a time: ask again later.");
  const auto archive = std::make_shared<SessionZip>(session.path);
  WebReply reply{.type = "application/zip", .download_as = plain_name(session.name + ".zip")};
  reply.pieces = [archive, running] { return archive->next(); };
  reply.bytes = archive->bytes();
  return reply;
} catch (const std::exception& e) {
  return refused(409, e.what());
}

void SessionDownloads::bag(const Session& session, SendReply reply) try {
  const auto running = one_of(bags_, kMostBags);
  if (!running) return reply(refused(503, "Another bag is being made: ask again later."));
  const auto place = std::make_shared<UnfinishedFolder>(sessions_ / (session.name + kBag));
  const auto done = [session, place, running, reply](const Captured& answer) {
    if (answer.exit_code != 0 && answer.exit_code != kInPart) return reply(refused(409, last_line(answer.err)));
    try {
      WebReply made{.type = "application/octet-stream"};
      made.file =
          open_regular_file(place->path() / (session.name + ".bag"), std::numeric_limits<std::int64_t>::max(), "a bag");
      made.download_as = plain_name(session.name + (answer.exit_code == 0 ? "" : "-incomplete") + ".bag");
      std::error_code ignored;
      fs::remove_all(place->path(), ignored);
      reply(std::move(made));
    } catch (const std::exception& e) {
      reply(refused(500, e.what()));
    }
  };
  capture(io_,
          {program_, "session", "export", session.path.string(), "--format", "bag", "--out", place->path().string()},
          done, kLongestExport);
} catch (const std::exception& e) {
  reply(refused(502, e.what()));
}

}  // namespace tankrig
