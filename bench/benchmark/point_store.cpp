#include "bench/benchmark/point_store.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <limits>
#include <optional>

#include "core/input_error.hpp"
#include "core/regular_file.hpp"
#include "core/text_files.hpp"

namespace fs = std::filesystem;
using nlohmann::ordered_json;

namespace tankrig {
namespace {

const char* const kPoints = "points.jsonl";
constexpr std::size_t kMostLineBytes = std::size_t{64} << 20;  ///< a configuration with long logs has thousands

std::string line_of(std::size_t point, const ordered_json& row) {
  ordered_json line{{"point", point}};
  line.update(row);
  return line.dump() + "\n";
}

/// A points.jsonl, read in pieces.
class Lines {
 public:
  explicit Lines(const fs::path& file)
      : file_(file),
        descriptor_(open_regular_file(file, std::numeric_limits<std::uint64_t>::max(), "what tankrig bench writes")) {}
  ~Lines() { ::close(descriptor_); }
  Lines(const Lines&) = delete;
  Lines& operator=(const Lines&) = delete;

  std::string_view at(std::uint64_t offset, std::uint64_t length) {
    text_.resize(length);
    if (read(text_.data(), length, offset) < length) throw InputError(file_, "has become shorter");
    return text_;
  }

  /// Calls use(line without its end, its offset, its number) for every whole line.
  template <class Use>
  void for_each(Use use) {
    std::uint64_t offset = 0;  // of what text_ holds
    for (int number = 1;;) {
      const std::size_t had = text_.size();
      text_.resize(had + (1U << 20));
      const std::size_t got = read(text_.data() + had, text_.size() - had, offset + had);
      text_.resize(had + got);
      std::size_t begin = 0;
      for (std::size_t end; (end = text_.find('\n', begin)) != std::string::npos; begin = end + 1)
        use(std::string_view(text_).substr(begin, end - begin), offset + begin, number++);
      text_.erase(0, begin);
      offset += begin;
      if (got == 0) return;
      if (text_.size() > kMostLineBytes) throw InputError(file_, number, "is longer than 64 MiB");
    }
  }

 private:
  std::size_t read(char* to, std::size_t size, std::uint64_t offset) {
    std::size_t got = 0;
    while (got < size) {
      const ssize_t part = ::pread(descriptor_, to + got, size - got, static_cast<off_t>(offset + got));
      if (part < 0 && errno == EINTR) continue;
      if (part < 0) throw InputError(file_, std::string("cannot be read: ") + std::strerror(errno));
      if (part == 0) break;
      got += static_cast<std::size_t>(part);
    }
    return got;
  }

  const fs::path file_;
  const int descriptor_;
  std::string text_;
};

/// What a row's line is, without its values in memory: an object with a number `point` and with `values`.
class RowReader final : public nlohmann::json_sax<ordered_json> {
 public:
  /// Nothing if it is none.
  static std::optional<std::size_t> point_of(std::string_view line) {
    RowReader reader;
    if (!ordered_json::sax_parse(line, &reader) || !reader.has_values_) return std::nullopt;
    return reader.point_;
  }

  bool null() override { return value(); }
  bool boolean(bool) override { return value(); }
  bool number_integer(std::int64_t) override { return value(); }
  bool number_unsigned(std::uint64_t number) override {
    if (depth_ == 1 && key_ == "point") point_ = number;
    return value();
  }
  bool number_float(double, const std::string&) override { return value(); }
  bool string(std::string&) override { return value(); }
  bool binary(binary_t&) override { return value(); }
  bool start_object(std::size_t) override { return ++depth_ > 0; }
  bool end_object() override { return depth_-- > 0; }
  bool start_array(std::size_t) override { return depth_++ > 0; }
  bool end_array() override { return depth_-- > 0; }
  bool key(std::string& name) override {
    if (depth_ != 1) return true;
    key_ = name;
    has_values_ = has_values_ || key_ == "values";
    return true;
  }
  bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception&) override { return false; }

 private:
  bool value() const { return depth_ > 0; }  // a line is an object

  int depth_ = 0;
  std::string key_;  ///< of the object itself
  bool has_values_ = false;
  std::optional<std::size_t> point_;
};

/// Makes the folder's file where there is none, and cuts an unfinished line off.
PointRows prepared(const fs::path& folder, const ordered_json& run) {
  fs::create_directories(folder);
  const fs::path file = folder / kPoints;
  if (!fs::exists(file)) {
    if (!fs::is_empty(folder)) throw InputError(folder, "is not empty, expected a new folder or one of this benchmark");
    write_file_durably(file, run.dump() + "\n");
  }
  PointRows rows(folder);
  check_run(folder, rows.run(), run);
  return rows;
}

std::string words(const ordered_json& text) { return text.is_string() ? text.get<std::string>() : text.dump(); }

}  // namespace

void check_run(const fs::path& folder, const ordered_json& before, const ordered_json& run) {
  for (const ordered_json* one : {&before, &run})
    for (const auto& [key, value] : one->items())
      if (const ordered_json found = before.value(key, ordered_json()), expected = run.value(key, ordered_json());
          found != expected)
        throw InputError(folder, fmt::format("holds results of another run: {} is {}, expected {}; give another --out",
                                             key, found.dump(), expected.dump()));
}

PointRows::PointRows(const fs::path& folder) : file_(folder / kPoints) {
  Lines(file_).for_each([&](std::string_view text, std::uint64_t offset, int number) {
    if (number == 1) {
      run_ = ordered_json::parse(text, nullptr, false);
      if (!run_.is_object() || !run_.contains("benchmark_sha256"))
        throw InputError(file_, number, "found no run of a benchmark, expected what tankrig bench writes");
    } else {
      const auto point = RowReader::point_of(text);
      if (!point) throw InputError(file_, number, "found no configuration's results, expected one a line");
      places_[*point] = {offset, text.size()};
    }
    end_ = offset + text.size() + 1;
  });
  if (run_.is_null()) throw InputError(file_, "is empty, expected results of tankrig bench");
}

ordered_json PointRows::row(std::size_t point) const {
  const Place& place = places_.at(point);
  ordered_json row = ordered_json::parse(Lines(file_).at(place.offset, place.length));
  row.erase("point");
  return row;
}

void PointRows::for_each(const std::function<void(std::size_t, const ordered_json&)>& use) const {
  Lines lines(file_);
  for (const auto& [point, place] : places_) {
    ordered_json row = ordered_json::parse(lines.at(place.offset, place.length));
    row.erase("point");
    use(point, row);
  }
}

PointStore::PointStore(const fs::path& folder, const ordered_json& run) : rows_(prepared(folder, run)) {
  fs::resize_file(rows_.file_, rows_.end_);
  reused_ = rows_.size();
  descriptor_ = ::open(rows_.file_.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
  if (descriptor_ < 0) throw CannotWrite(rows_.file_, errno);
}

PointStore::~PointStore() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void PointStore::append(std::size_t point, std::string_view line) {
  const PointRows::Place place{rows_.end_, line.size() - 1};
  std::string_view left = line;
  write_all(rows_.file_, descriptor_, left);
  rows_.end_ += line.size();
  rows_.places_[point] = place;
}

void PointStore::add(std::size_t point, const ordered_json& row) {
  const std::lock_guard lock(mutex_);
  append(point, line_of(point, row));
  sync_file(rows_.file_, descriptor_);
}

void PointStore::add(const PointRows& rows) {
  const std::lock_guard lock(mutex_);
  Lines lines(rows.file_);
  for (const auto& [point, place] : rows.places_)
    if (!rows_.contains(point)) append(point, std::string(lines.at(place.offset, place.length)) + "\n");
  sync_file(rows_.file_, descriptor_);
}

void drop_loops_left_out(Benchmark& benchmark, const ordered_json& run) {
  if (!run.contains(kLoopsLeftOut)) return;
  for (const auto& line : run[kLoopsLeftOut])
    std::erase_if(benchmark.updaters, [&](const Updater& updater) { return line == updater.line; });
}

std::string point_error(const ordered_json& row) {
  if (row.contains("error")) return words(row["error"]);
  std::string text;
  if (row.contains("measures"))
    for (const auto& [name, values] : row["measures"].items())
      if (values.contains("error")) text += (text.empty() ? "" : "; ") + name + ": " + words(values["error"]);
  return text;
}

}  // namespace tankrig
