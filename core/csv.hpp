// CSV tables of a session: a header line, then one record a line.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace tankrig {

/// One record, with the line it stands on.
struct CsvRow {
  int line = 0;
  std::vector<std::string> fields;
};

struct CsvTable {
  std::filesystem::path file;
  std::vector<std::string> columns;
  std::vector<CsvRow> rows;
  bool cut_short = false;  ///< the file did not end with a line end: its last line was left out

  /// Throws InputError "FILE:LINE: column: found ..., expected ...".
  [[noreturn]] void fail(const CsvRow& row, std::size_t column, std::string_view expected) const;
};

/// Reads a whole table whose header must be exactly `columns`. Fields may be quoted as in RFC 4180. With
/// `may_be_cut_in_header`, a file that ends within its header is a table without rows, `cut_short`.
/// Errors: InputError with file and line.
CsvTable read_csv(const std::filesystem::path& file, const std::vector<std::string>& columns,
                  bool may_be_cut_in_header = false);

/// Fields of one line.
std::vector<std::string> split_csv_line(std::string_view line);

/// `text` as one CSV field on one line, quoted if necessary; line ends become blanks.
std::string csv_field(std::string_view text);

}  // namespace tankrig
