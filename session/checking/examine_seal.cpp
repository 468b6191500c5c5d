// What the seal says of the files that no other step spoke of.
#include "core/input_error.hpp"
#include "session/checking/examination.hpp"
#include "session/checking/sha256.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;
using Kind = ChecksumDifference::Kind;

void tell_files(const std::vector<std::string>& files, const std::string& what, std::vector<std::string>& list) {
  constexpr std::size_t kNamed = 5;
  for (std::size_t i = 0; i < std::min(files.size(), kNamed); ++i) list.push_back(files[i] + ": " + what);
  if (files.size() > kNamed) list.push_back(plural(files.size() - kNamed, "more file") + ": " + what);
}

/// Files that session.yaml knows without the seal. What `recover` could not bring back is told no second time.
void compare_with_session_yaml(Examination& so_far) {
  std::error_code ignored;
  const auto there = [&](const std::string& file) { return fs::is_regular_file(so_far.session / file, ignored); };
  for (const std::string& loss : so_far.info.recovered) so_far.told.insert(loss.substr(0, loss.find(": ")));
  if (!so_far.info.rig_hash.empty() && !so_far.told.contains("rig.yaml")) {
    if (!there("rig.yaml"))
      so_far.lose("rig.yaml", "missing");
    else if (sha256_of_file(so_far.session / "rig.yaml") != so_far.info.rig_hash)
      so_far.lose("rig.yaml", "not as recorded, its SHA-256 differs");
  }
  if (so_far.info.object && !so_far.told.contains(so_far.info.object->mesh) && !there(so_far.info.object->mesh))
    so_far.lose(so_far.info.object->mesh, "missing");
}

}  // namespace

void read_seal(Examination& so_far) {
  std::error_code ignored;
  so_far.sealed = fs::exists(so_far.session / "SHA256SUMS", ignored);
  if (!so_far.sealed) {
    so_far.undone.push_back("SHA256SUMS: there is none, the session was never sealed");
    return;
  }
  try {
    for (const auto& [file, kind] : compare_checksums(so_far.session)) so_far.unlike_seal[file] = kind;
    so_far.seal_read = true;
  } catch (const InputError& e) {
    so_far.lose("SHA256SUMS", "cannot be read (" + within(so_far.session, e.what()) + ")");
  }
}

/// What the seal says of the files nobody spoke of yet. What was made of a recording can be made again: no loss.
void compare_rest(Examination& so_far) {
  std::vector<std::string> made_since, other, foreign;
  for (const auto& [file, kind] : so_far.unlike_seal) {
    if (so_far.told.contains(file)) continue;
    if (is_derived(file)) {
      (kind == Kind::kNotListed ? made_since : other).push_back(file);
      if (kind == Kind::kChanged) so_far.set_aside.insert(file);
    } else if (kind == Kind::kNotListed) {
      if (!file.starts_with("spool/")) foreign.push_back(file);
    } else {
      so_far.lose(file, kind == Kind::kMissing ? "missing" : "changed since it was sealed");
    }
  }
  tell_files(made_since, "made from the recording after sealing; not sealed yet", so_far.undone);
  tell_files(other, "not as sealed, can be made again from the recording", so_far.undone);
  tell_files(foreign, "not listed in SHA256SUMS", so_far.extra);
  compare_with_session_yaml(so_far);
}

}  // namespace tankrig
