#include "console/platform/store.hpp"

#include <fmt/format.h>
#include <sqlite3.h>
#include <sys/random.h>

#include <array>

#include "core/atomic_file.hpp"

namespace fs = std::filesystem;

namespace tankrig {
namespace {

// One server at a time: its lock ends with its process.
constexpr const char* kSchema = R"(
PRAGMA locking_mode = EXCLUSIVE;
PRAGMA journal_mode = WAL;
PRAGMA synchronous = NORMAL;
CREATE TABLE IF NOT EXISTS submissions (
  number INTEGER PRIMARY KEY, id TEXT NOT NULL UNIQUE, dataset TEXT NOT NULL, file TEXT NOT NULL, name TEXT NOT NULL,
  uses TEXT NOT NULL, user TEXT NOT NULL, address TEXT NOT NULL, received_s INTEGER NOT NULL, bytes INTEGER NOT NULL,
  state TEXT NOT NULL, message TEXT NOT NULL DEFAULT '', figures TEXT NOT NULL DEFAULT '', rank REAL NOT NULL DEFAULT 0,
  tries INTEGER NOT NULL DEFAULT 0) STRICT;
CREATE INDEX IF NOT EXISTS by_state ON submissions (state, number);
CREATE INDEX IF NOT EXISTS by_dataset ON submissions (dataset, state, rank);
CREATE INDEX IF NOT EXISTS by_user ON submissions (user, received_s);
CREATE INDEX IF NOT EXISTS by_address ON submissions (address, received_s);
UPDATE submissions SET state = 'failed', message = 'the server ended twice while this was scored'
  WHERE state = 'running' AND tries > 1;
UPDATE submissions SET state = 'queued' WHERE state = 'running';
)";

constexpr const char* kColumns =
    "id, dataset, file, name, uses, user, address, received_s, bytes, state, message, figures, rank";

[[noreturn]] void fail(sqlite3* database) {
  throw InputError(std::string(sqlite3_db_filename(database, "main")) + ": " + sqlite3_errmsg(database));
}

}  // namespace

class Store::Statement {
 public:
  Statement(const Store& store, const std::string& sql) : database_(store.database_.get()) {
    if (sqlite3_prepare_v2(database_, sql.c_str(), -1, &statement_, nullptr) != SQLITE_OK) fail(database_);
  }
  ~Statement() { sqlite3_finalize(statement_); }
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  Statement& bind(const std::string& text) {
    return check(sqlite3_bind_text(statement_, ++bound_, text.data(), static_cast<int>(text.size()), SQLITE_TRANSIENT));
  }
  Statement& bind(std::int64_t number) { return check(sqlite3_bind_int64(statement_, ++bound_, number)); }
  Statement& bind(double number) { return check(sqlite3_bind_double(statement_, ++bound_, number)); }

  /// Whether there is another row.
  bool step() {
    const int result = sqlite3_step(statement_);
    if (result != SQLITE_ROW && result != SQLITE_DONE) fail(database_);
    return result == SQLITE_ROW;
  }
  std::int64_t number(int column) const { return sqlite3_column_int64(statement_, column); }
  double real(int column) const { return sqlite3_column_double(statement_, column); }
  std::string text(int column) const {
    const auto* const bytes = sqlite3_column_text(statement_, column);
    return {reinterpret_cast<const char*>(bytes), static_cast<std::size_t>(sqlite3_column_bytes(statement_, column))};
  }
  /// Of a row of kColumns.
  Submission submission() const {
    return {text(0), text(1),   text(2),
            text(3), text(4),   text(5),
            text(6), number(7), static_cast<std::uint64_t>(number(8)),
            text(9), text(10),  text(11),
            real(12)};
  }

 private:
  Statement& check(int result) {
    if (result != SQLITE_OK) fail(database_);
    return *this;
  }
  sqlite3* database_;
  sqlite3_stmt* statement_ = nullptr;
  int bound_ = 0;
};

/// What is done while it lives is undone unless it is committed.
class Store::Transaction {
 public:
  explicit Transaction(const Store& store) : store_(store) { Statement(store, "BEGIN").step(); }
  ~Transaction() {
    if (open_) sqlite3_exec(store_.database_.get(), "ROLLBACK", nullptr, nullptr, nullptr);
  }
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;
  void commit() {
    Statement(store_, "COMMIT").step();
    open_ = false;
  }

 private:
  const Store& store_;
  bool open_ = true;
};

Store::Store(const fs::path& folder) : folder_(folder), database_(nullptr, &sqlite3_close) {
  fs::create_directories(folder / "submissions");
  sqlite3* opened = nullptr;
  const int result = sqlite3_open((folder / "platform.db").c_str(), &opened);
  database_.reset(opened);
  if (result != SQLITE_OK || sqlite3_exec(opened, kSchema, nullptr, nullptr, nullptr) != SQLITE_OK) fail(opened);
  remove_strays();
}

Store::~Store() = default;

void Store::remove_strays() const {
  for (const auto& entry : fs::directory_iterator(folder_ / "submissions"))
    if (!find(entry.path().filename().string())) fs::remove_all(entry.path());
}

std::string Store::new_id() {
  constexpr std::string_view kLetters = "0123456789abcdefghjkmnpqrstvwxyz";
  std::array<unsigned char, 16> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    throw InputError("platform: no random numbers from the system, expected some for a link");
  std::string id;
  for (const unsigned char byte : bytes) id += kLetters[byte % kLetters.size()];
  return id;
}

void Store::add(const std::vector<Submission>& submissions) {
  Transaction transaction(*this);
  for (const Submission& s : submissions) insert(s);
  transaction.commit();
}

void Store::insert(const Submission& s) {
  Statement(*this, fmt::format("INSERT INTO submissions ({}) VALUES (?,?,?,?,?,?,?,?,?,?,?,?,?)", kColumns))
      .bind(s.id)
      .bind(s.dataset)
      .bind(s.file)
      .bind(s.name)
      .bind(s.uses)
      .bind(s.user)
      .bind(s.address)
      .bind(s.received_s)
      .bind(static_cast<std::int64_t>(s.bytes))
      .bind(s.state)
      .bind(s.message)
      .bind(s.figures)
      .bind(s.rank)
      .step();
}

bool Store::withdraw(const std::string& id) {
  Statement statement(*this, "DELETE FROM submissions WHERE id = ? AND state = 'queued' RETURNING id");
  bool there = false;
  for (statement.bind(id); statement.step();) there = true;
  return there;
}

std::optional<Submission> Store::take() {
  Statement statement(
      *this, fmt::format("UPDATE submissions SET state = 'running', tries = tries + 1 WHERE number = "
                         "(SELECT number FROM submissions WHERE state = 'queued' ORDER BY number LIMIT 1) RETURNING {}",
                         kColumns));
  const std::vector<Submission> taken = list(statement);
  return taken.empty() ? std::nullopt : std::optional(taken.front());
}

void Store::finish(const Submission& s) {
  Statement(*this, "UPDATE submissions SET state = ?, message = ?, figures = ?, rank = ? WHERE id = ?")
      .bind(s.state)
      .bind(s.message)
      .bind(s.figures)
      .bind(s.rank)
      .bind(s.id)
      .step();
}

void Store::put_back() {
  Statement(*this, "UPDATE submissions SET state = 'queued', tries = tries - 1 WHERE state = 'running'").step();
}

std::vector<Submission> Store::list(Statement& statement) const {
  std::vector<Submission> out;
  while (statement.step()) out.push_back(statement.submission());
  return out;
}

std::optional<Submission> Store::find(const std::string& id) const {
  Statement statement(*this, fmt::format("SELECT {} FROM submissions WHERE id = ?", kColumns));
  const std::vector<Submission> found = list(statement.bind(id));
  return found.empty() ? std::nullopt : std::optional(found.front());
}

std::vector<Submission> Store::best(const std::string& dataset, int most) const {
  Statement statement(
      *this,
      fmt::format("SELECT {} FROM submissions WHERE dataset = ? AND state = 'done' ORDER BY rank DESC, number LIMIT ?",
                  kColumns));
  return list(statement.bind(dataset).bind(std::int64_t{most}));
}

std::vector<Submission> Store::newest(const std::string& dataset, int most) const {
  Statement statement(
      *this, fmt::format("SELECT {} FROM submissions WHERE dataset = ? ORDER BY number DESC LIMIT ?", kColumns));
  return list(statement.bind(dataset).bind(std::int64_t{most}));
}

int Store::waiting() const {
  Statement statement(*this, "SELECT count(*) FROM submissions WHERE state IN ('queued', 'running')");
  statement.step();
  return static_cast<int>(statement.number(0));
}

int Store::before(const std::string& id) const {
  Statement statement(
      *this,
      "SELECT count(*) FROM submissions WHERE state IN ('queued', 'running') AND number < (SELECT number "
      "FROM submissions WHERE id = ?)");
  statement.bind(id).step();
  return static_cast<int>(statement.number(0));
}

Usage Store::usage(Whose whose, const std::string& name, std::int64_t since_s) const {
  const char* const column = whose == Whose::kUser ? "user" : "address";
  Statement lately(*this, fmt::format("SELECT count(*), ifnull(sum(bytes), 0), ifnull(min(received_s), 0) FROM "
                                      "submissions WHERE {} = ? AND received_s > ?",
                                      column));
  lately.bind(name).bind(since_s).step();
  Statement waiting(
      *this, fmt::format("SELECT count(*) FROM submissions WHERE state IN ('queued', 'running') AND {} = ?", column));
  waiting.bind(name).step();
  return {static_cast<int>(lately.number(0)), static_cast<std::uint64_t>(lately.number(1)),
          static_cast<int>(waiting.number(0)), lately.number(2)};
}

}  // namespace tankrig
