// `tankrig init`: a rig of one's own to edit, complete in one folder.
#include <cstdio>
#include <regex>

#include "apps/tankrig/commands.hpp"
#include "apps/tankrig/rig_files.hpp"
#include "core/config_node.hpp"
#include "core/input_error.hpp"
#include "rig/session/text_files.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

/// `text` with every path in front of the file name `name` removed: "../objects/box.obj" becomes "box.obj".
std::string without_folder(const std::string& text, const std::string& name) {
  const std::string literal = std::regex_replace(name, std::regex(R"([.^$|()\[\]{}*+?\\])"), R"(\$&)");
  return std::regex_replace(text, std::regex(R"([\w./-]*/)" + literal), name);
}

}  // namespace

int init(const InitOptions& options) {
  const fs::path rig_file = find_rig(options.from);
  if (fs::exists(options.directory)) throw InputError(options.directory, "exists already, expected a new folder");
  const ConfigNode rig = ConfigNode::load(rig_file);
  const fs::path scene = rig.path("scene"), mesh = rig.child("object").path("mesh");
  fs::path building = options.directory;
  building += ".partial";
  fs::remove_all(building);
  fs::create_directories(building);
  const std::string text = without_folder(read_whole_file(rig_file), scene.filename());
  write_whole_file(building / "rig.yaml", without_folder(text, mesh.filename()));
  write_whole_file(building / scene.filename(), without_folder(read_whole_file(scene), mesh.filename()));
  copy_whole_file(mesh, building / mesh.filename());
  fs::rename(building, options.directory);
  std::printf("%s: edit rig.yaml, then  tankrig scan --rig %s\n", options.directory.c_str(), options.directory.c_str());
  return kOk;
}

}  // namespace tankrig::app
