#include "core/csv.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/input_error.hpp"
#include "core/shown_text.hpp"
#include "core/text_files.hpp"

namespace tankrig {

void CsvTable::fail(const CsvRow& row, std::size_t column, std::string_view expected) const {
  throw InputError(
      file, row.line,
      fmt::format("{}: found '{}', expected {}", columns[column], shown_text(row.fields[column]), expected));
}

std::vector<std::string> split_csv_line(std::string_view line) {
  std::vector<std::string> fields(1);
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (quoted) {
      if (c == '"' && i + 1 < line.size() && line[i + 1] == '"')
        fields.back() += line[++i];
      else if (c == '"')
        quoted = false;
      else
        fields.back() += c;
    } else if (c == '"')
      quoted = true;
    else if (c == ',')
      fields.emplace_back();
    else
      fields.back() += c;
  }
  return fields;
}

std::string csv_field(std::string_view text) {
  std::string flat(text);
  std::replace_if(
      flat.begin(), flat.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
  if (flat.find_first_of(",\"") == std::string::npos) return flat;
  std::string out = "\"";
  for (const char c : flat) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + '"';
}

CsvTable read_csv(const std::filesystem::path& file, const std::vector<std::string>& columns,
                  bool may_be_cut_in_header) {
  const std::string text = read_whole_file(file), header = fmt::format("{}", fmt::join(columns, ","));
  if (text.find('\n') == std::string::npos && !(may_be_cut_in_header && header.starts_with(text)))
    throw InputError(file, 1,
                     (text.empty() ? "found nothing" : "found '" + shown_text(text) + "' without a line end") +
                         ", expected the header " + header);
  CsvTable table{file, columns, {}, !text.ends_with('\n')};
  int line_number = 0;
  std::size_t begin = 0;
  for (std::size_t end; (end = text.find('\n', begin)) != std::string::npos; begin = end + 1) {
    ++line_number;
    std::string_view line(text.data() + begin, end - begin);
    if (line.ends_with('\r')) line.remove_suffix(1);
    CsvRow row{line_number, split_csv_line(line)};
    if (line_number == 1) {
      for (std::size_t i = 0; i < std::max(columns.size(), row.fields.size()); ++i) {
        const std::string found = i < row.fields.size() ? row.fields[i] : "nothing",
                          expected = i < columns.size() ? columns[i] : "nothing";
        if (found != expected)
          throw InputError(file, 1,
                           fmt::format("column {}: found '{}', expected '{}' of the header {}", i + 1,
                                       shown_text(found), expected, header));
      }
      continue;
    }
    if (row.fields.size() != columns.size())
      throw InputError(file, line_number,
                       fmt::format("found {} fields, expected {}", row.fields.size(), columns.size()));
    table.rows.push_back(std::move(row));
  }
  return table;
}

}  // namespace tankrig
