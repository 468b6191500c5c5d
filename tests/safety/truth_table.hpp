// Reads the truth table out of a header's comment, so that the comment itself is tested.
#pragma once

#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace tankrig::testing_support {

/// Lines "/// | a b | c | -> x y | remark": the first names the columns, the others are rows of "-" (any), "yes", "no"
/// and "edge".
class TruthTable {
 public:
  struct Value {
    bool level = false, edge = false;
  };

  static TruthTable in_file(const std::string& file) {
    std::ifstream lines(file);
    TruthTable table;
    for (std::string line; std::getline(lines, line);) {
      const std::size_t bar = line.find("|"), arrow = line.find("| ->");
      if (line.rfind("///", 0) != 0 || line.find_first_not_of("/ ") != bar || arrow == std::string::npos) continue;
      const std::vector<std::string> in = words(line.substr(bar, arrow - bar));
      const std::vector<std::string> out = words(line.substr(arrow + 4, line.find('|', arrow + 4) - arrow - 4));
      if (table.names_.empty()) {
        table.names_ = in;
        continue;
      }
      if (in.size() != table.names_.size()) throw std::runtime_error("a row of another length: " + line);
      table.rows_.push_back(in);
      std::vector<bool> outcome;
      for (const std::string& word : out) {
        if (word != "yes" && word != "no") throw std::runtime_error("neither yes nor no: " + line);
        outcome.push_back(word == "yes");
      }
      table.outcomes_.push_back(outcome);
      std::vector<Cell> cells;
      for (const std::string& word : in) cells.push_back(cell_of(word));
      table.cells_.push_back(cells);
    }
    return table;
  }

  std::size_t rows() const { return rows_.size(); }
  std::size_t inputs() const { return names_.size(); }
  std::size_t input(const std::string& name) const {
    for (std::size_t i = 0; i < names_.size(); ++i)
      if (names_[i] == name) return i;
    throw std::runtime_error("the table has no column " + name);
  }
  /// The first row that applies; rows() if none does.
  std::size_t row_of(const std::vector<Value>& values) const {
    for (std::size_t r = 0; r < cells_.size(); ++r) {
      bool applies = true;
      for (std::size_t i = 0; applies && i < values.size(); ++i) applies = matches(cells_[r][i], values[i]);
      if (applies) return r;
    }
    return rows();
  }
  const std::vector<bool>& outcome(std::size_t row) const { return outcomes_[row]; }

 private:
  enum class Cell { kAny, kYes, kNo, kEdge };

  static Cell cell_of(const std::string& word) {
    if (word == "-") return Cell::kAny;
    if (word == "yes") return Cell::kYes;
    if (word == "no") return Cell::kNo;
    if (word == "edge") return Cell::kEdge;
    throw std::runtime_error("unknown word in the table: " + word);
  }
  static bool matches(Cell cell, const Value& value) {
    return cell == Cell::kAny || (cell == Cell::kYes && value.level) || (cell == Cell::kNo && !value.level) ||
           (cell == Cell::kEdge && value.edge);
  }
  static std::vector<std::string> words(const std::string& text) {
    std::vector<std::string> all;
    std::string word;
    for (const char c : text + " ") {
      if (c != ' ' && c != '|') {
        word += c;
      } else if (!word.empty()) {
        all.push_back(word);
        word.clear();
      }
    }
    return all;
  }

  std::vector<std::string> names_;
  std::vector<std::vector<std::string>> rows_;
  std::vector<std::vector<Cell>> cells_;
  std::vector<std::vector<bool>> outcomes_;
};

}  // namespace tankrig::testing_support
