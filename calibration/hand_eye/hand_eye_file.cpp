#include "calibration/hand_eye/hand_eye_file.hpp"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include "core/camera_file.hpp"
#include "core/csv.hpp"
#include "core/input_error.hpp"
#include "core/model_yaml.hpp"
#include "core/plausible_length.hpp"
#include "core/shown_text.hpp"
#include "core/text_files.hpp"

namespace fs = std::filesystem;

namespace tankrig {
namespace {

fs::path inside(const fs::path& folder, const std::string& name, const auto& refuse) {
  if (name.empty() || !stays_inside(name)) refuse();
  return folder / name;
}

HandEyeEntry entry_of(const ConfigNode& node, const fs::path& folder) {
  HandEyeEntry entry;
  if (node.has("image") == node.has("cMg")) node.fail("image", "expected an image or cMg, the marker's pose");
  if (node.has("q_rad") == node.has("bMe")) node.fail("q_rad", "expected q_rad, five joints, or bMe");
  if (node.has("image")) {
    entry.name = node.text("image");
    entry.image = inside(folder, entry.name, [&] { node.fail("image", "expected a file in the folder"); });
  } else {
    entry.cMg = node.transform("cMg");
  }
  if (node.has("q_rad")) {
    const std::vector<double> q = node.numbers("q_rad", kJoints);
    entry.q = Eigen::Map<const JointVector>(q.data());
  } else {
    entry.bMe = node.transform("bMe");
  }
  node.finish();
  return entry;
}

const std::vector<std::string> kJointColumns{"q_slew_rad", "q_shoulder_rad", "q_elbow_rad", "q_jaw_rotate_rad",
                                             "q_jaw_opening_rad"};

std::vector<std::string> pose_columns(const std::string& pose) {
  std::vector<std::string> columns;
  for (const char* part : {"x_m", "y_m", "z_m", "qx", "qy", "qz", "qw"}) columns.push_back(pose + "_" + part);
  return columns;
}

std::vector<std::string> joined(std::vector<std::string> a, const std::vector<std::string>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

std::vector<HandEyeEntry> entries_of_csv(const fs::path& file) {
  const std::string text = read_whole_file(file);
  const std::string header = text.substr(0, text.find_first_of("\r\n"));
  const std::vector<std::string> cMg = pose_columns("cMg"), bMe = pose_columns("bMe");
  std::vector<std::string> columns;
  for (const auto& layout :
       {joined({"image"}, kJointColumns), joined({"image"}, bMe), joined(cMg, kJointColumns), joined(cMg, bMe)})
    if (fmt::format("{}", fmt::join(layout, ",")) == header) columns = layout;
  if (columns.empty())
    throw InputError(
        file, 1,
        fmt::format("found the columns '{}', expected `image` or {}, then {} or {}", shown_text(header.substr(0, 200)),
                    fmt::join(cMg, ","), fmt::join(kJointColumns, ","), fmt::join(bMe, ",")));
  const CsvTable table = read_csv(file, columns);
  if (table.cut_short) throw InputError(file, "the last line has no end, expected a whole table");
  std::vector<HandEyeEntry> entries;
  for (const CsvRow& row : table.rows) {
    const auto number = [&](std::size_t column) {
      double value = 0;
      if (!parse_number(row.fields[column], value) || !(plausible_length(value)))
        table.fail(row, column, "a number, in metres or radians");
      return value;
    };
    const auto pose = [&](std::size_t first) {
      Eigen::Vector4d xyzw;
      for (std::size_t k = 0; k < 4; ++k) xyzw[static_cast<int>(k)] = number(first + 3 + k);
      if (!(std::abs(xyzw.norm() - 1) < 1e-3)) table.fail(row, first + 3, "a quaternion of length 1");
      return make_transform({number(first), number(first + 1), number(first + 2)}, xyzw);
    };
    HandEyeEntry entry;
    const bool picture = columns[0] == "image";
    entry.name = picture ? row.fields[0] : fmt::format("{}:{}", file.filename().string(), row.line);
    if (picture)
      entry.image = inside(file.parent_path(), row.fields[0], [&] { table.fail(row, 0, "a file in the folder"); });
    else
      entry.cMg = pose(0);
    const std::size_t arm = picture ? 1 : cMg.size();
    if (columns[arm] == kJointColumns[0]) {
      entry.q.emplace();
      for (std::size_t k = 0; k < kJoints; ++k) (*entry.q)[static_cast<int>(k)] = number(arm + k);
    } else {
      entry.bMe = pose(arm);
    }
    entries.push_back(entry);
  }
  return entries;
}

}  // namespace

HandEyeData read_hand_eye_folder(const fs::path& given) {
  HandEyeData data;
  data.file = fs::is_directory(given) ? given / "hand_eye.yaml" : given;
  data.files = {data.file};
  const ConfigNode root = ConfigNode::load(data.file);
  const fs::path folder = data.file.parent_path();
  for (const char* key : {"camera", "views_csv"})
    if (root.has(key)) data.files.push_back(root.path(key));
  if (root.has("camera")) data.camera = read_camera_file(root.path("camera"));
  if (const auto node = root.optional_child("marker")) data.marker = settings_from(*node, kGripperMarkerKeys);
  if (const auto node = root.optional_child("arm")) data.arm = settings_from(*node, kArmModelKeys);
  if (root.has("target_c_m")) data.target_c = read_vector(root, "target_c_m");
  data.marker_size = root.number_or("marker_size_m", data.marker_size, {0.001, 1});
  if (root.has("views_csv") == root.has("views")) root.fail("views", "expected a list, or a table named by views_csv");
  if (root.has("views_csv")) {
    data.views = entries_of_csv(root.path("views_csv"));
  } else {
    int number = 0;
    for (const ConfigNode& node : root.items("views")) {
      data.views.push_back(entry_of(node, folder));
      ++number;
      if (data.views.back().name.empty()) data.views.back().name = fmt::format("view {}", number);
    }
  }
  root.finish();
  for (const HandEyeEntry& entry : data.views) {
    const HandEyeEntry& first = data.views.front();
    if (entry.image.empty() != first.image.empty() || entry.q.has_value() != first.q.has_value())
      throw InputError(data.file, entry.name + " is of another kind than " + first.name + ", expected all views alike");
    if (!entry.image.empty() && (!data.camera || !data.marker))
      throw InputError(data.file, "views: found pictures without `camera` and `marker`, expected both");
  }
  return data;
}

}  // namespace tankrig
