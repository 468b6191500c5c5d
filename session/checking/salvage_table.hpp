// A damaged table of a session: every line that can still be read.
#pragma once

#include <filesystem>
#include <string>

#include "core/input_error.hpp"
#include "core/text_files.hpp"
#include "session/reading/session_tables.hpp"

namespace tankrig {

template <class Record>
struct SalvagedTable {
  std::vector<Record> records;
  std::string text;           ///< header and the lines of `records`
  std::size_t bad_lines = 0;  ///< left out: torn or unreadable
  bool missing = false;       ///< there is no such file
  bool damaged = false;       ///< the file says something else than `text`
};

/// `read` reads the whole table strictly. If it throws, `parse` reads line by line what it can, and `line_of` writes
/// each line again.
template <class Record, class Read, class Parse, class Write>
SalvagedTable<Record> salvage_table(const std::filesystem::path& file, const std::string& header, Read read,
                                    Parse parse, Write line_of) {
  SalvagedTable<Record> out;
  std::error_code ignored;
  out.missing = !std::filesystem::is_regular_file(file, ignored);
  out.damaged = out.missing;
  out.text = header;
  if (out.missing) return out;
  const std::string text = read_whole_file(file);
  try {
    SessionTable<Record> table = read(file, false);
    out.records = std::move(table.records);
    out.bad_lines = table.cut_short;
    out.damaged = table.cut_short;
    out.text = text.substr(0, text.rfind('\n') + 1);
    return out;
  } catch (const InputError&) {
    out.damaged = true;
  }
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = text.find('\n', begin);
    const bool whole = end != std::string::npos;
    const std::string line = text.substr(begin, whole ? end + 1 - begin : end);
    begin = whole ? end + 1 : text.size();
    if (line == header) continue;
    if (auto record = whole ? parse(line) : std::nullopt) {
      out.text += line_of(*record);
      out.records.push_back(std::move(*record));
    } else {
      ++out.bad_lines;
    }
  }
  return out;
}

}  // namespace tankrig
