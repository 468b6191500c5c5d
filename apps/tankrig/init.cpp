// `tankrig init`: a rig of one's own to edit, complete in one folder.
#include <cstdio>
#include <fstream>
#include <regex>
#include <sstream>

#include "apps/tankrig/commands.hpp"
#include "apps/tankrig/rig_files.hpp"
#include "core/config_node.hpp"
#include "core/input_error.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

std::string read_text(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) throw InputError(file, "cannot be read");
  return text.str();
}

void write_text(const fs::path& file, const std::string& text) {
  std::ofstream out(file, std::ios::binary);
  out << text << std::flush;
  if (!out) throw InputError(file, "cannot be written");
}

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
  fs::create_directories(options.directory);
  std::string text = without_folder(read_text(rig_file), scene.filename());
  write_text(options.directory / "rig.yaml", without_folder(text, mesh.filename()));
  write_text(options.directory / scene.filename(), without_folder(read_text(scene), mesh.filename()));
  fs::copy_file(mesh, options.directory / mesh.filename());
  std::printf("%s: edit rig.yaml, then  tankrig scan --rig %s\n", options.directory.c_str(), options.directory.c_str());
  return kOk;
}

}  // namespace tankrig::app
