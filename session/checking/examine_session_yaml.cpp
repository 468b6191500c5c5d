// session.yaml when it is cut or lost.
#include <algorithm>

#include "core/config_node.hpp"
#include "core/text_files.hpp"
#include "session/checking/examination.hpp"
#include "session/checking/sha256.hpp"
#include "session/reading/session_yaml.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;

constexpr const char* kNotProven = "the calibration is not proven to be the recorded one";

/// A line of session.yaml that begins with a key, and the indented ones after it.
struct Block {
  std::string key, text;
  bool whole = false;  ///< has its line end
};

std::vector<Block> blocks_of(const std::string& text) {
  std::vector<Block> blocks;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size() - 1) + 1;
    const std::string line = text.substr(begin, end - begin);
    begin = end;
    if (blocks.empty() || !line.starts_with(' ')) blocks.push_back({line.substr(0, line.find(':')), "", false});
    blocks.back().text += line;
    blocks.back().whole = line.ends_with('\n');
  }
  return blocks;
}

/// With a key of our own after it: a quoted text that has lost its end would swallow it.
bool read_block(const Block& block, const Setting<SessionInfo>& section, const fs::path& file, SessionInfo& info) {
  if (!block.whole) return false;
  SessionInfo with = info;
  try {
    const ConfigNode root = ConfigNode::parse(block.text + "end_of_block: here\n", file);
    root.text("end_of_block");
    section.read(root, with, true);
    root.finish();
  } catch (const InputError&) {
    return false;
  }
  info = std::move(with);
  return true;
}

/// The sections of a damaged session.yaml that are whole, and the keys of the others. The sections stand in a fixed
/// order: where a line makes no sense, the list before it may lack its end, and what should stand there is lost.
class Salvage {
 public:
  Salvage(const std::string& text, const fs::path& file) {
    std::vector<Block> blocks = blocks_of(text);
    const auto calibration =
        std::find_if(blocks.begin(), blocks.end(), [](const Block& b) { return b.key == "cameras"; });
    const bool cut = calibration == blocks.end();
    blocks.erase(calibration, blocks.end());
    for (const Block& block : blocks) take(block, file);
    if (cut) doubt();
    told_until(sections_.size());
  }

  SessionInfo info;
  std::vector<std::string> lost;

 private:
  void take(const Block& block, const fs::path& file) {
    const auto section = std::find_if(sections_.begin() + static_cast<std::ptrdiff_t>(next_), sections_.end(),
                                      [&](const Setting<SessionInfo>& s) { return s.name == block.key; });
    if (section == sections_.end() || !read_block(block, *section, file, info)) return doubt();
    told_until(static_cast<std::size_t>(section - sections_.begin()));
    ++next_;
    several_lines_ = std::count(block.text.begin(), block.text.end(), '\n') > 1;
  }

  void doubt() {
    if (several_lines_) lost.emplace_back(sections_[next_ - 1].name);
    several_lines_ = false, in_doubt_ = true;
  }

  /// Of the sections that were not found before this one, an optional one may never have been there.
  void told_until(std::size_t here) {
    for (; next_ < here; ++next_)
      if (sections_[next_].required || in_doubt_) lost.emplace_back(sections_[next_].name);
    in_doubt_ = false;
  }

  const std::span<const Setting<SessionInfo>> sections_ = kSessionKeys.rows;
  std::size_t next_ = 0;        ///< the section after the last one that was read
  bool several_lines_ = false;  ///< that one has
  bool in_doubt_ = false;       ///< since it there were lines that make no sense
};

SessionInfo described(const DescribeRig& describe, const fs::path& rig_yaml) {
  SessionInfo rig;
  try {
    if (describe) describe(rig_yaml, rig);
  } catch (const InputError&) {
    return {};
  }
  return rig;
}

bool told_before(const SessionInfo& info) {
  return std::any_of(info.recovered.begin(), info.recovered.end(), [](const std::string& loss) {
    return loss.starts_with("session.yaml: ") && loss.find(kNotProven) != std::string::npos;
  });
}

/// Cameras, calibration and object, from where they are proven to be as recorded, or else from where they are at all.
/// Returns what is to be said of them. An unproven calibration keeps the recorded SHA-256: readers go on warning.
std::string find_calibration(const fs::path& session, const DescribeRig& describe, SessionFindings& out) {
  std::string& recorded = out.info.calibration_hash;
  if (!out.calibration.empty() && sha256_of_text(out.calibration) == recorded) try {
      if (!out.info_known) read_calibration_yaml(out.calibration, session / "session.yaml", out.info);
      out.info_known = true;
      return "";
    } catch (const InputError&) {
    }
  const SessionInfo rig = described(describe, session / "rig.yaml");
  const std::string of_rig = rig.cameras.empty() ? "" : calibration_yaml(rig);
  const bool same = !of_rig.empty() && of_rig == out.calibration, proven = same || sha256_of_text(of_rig) == recorded;
  if (out.info_known && !proven) return out.calibration = calibration_yaml(out.info), kNotProven;
  if (of_rig.empty()) return "";
  take_calibration(rig, out.info);
  const std::string changed = out.info_known ? "its calibration was changed; " : "";
  out.info_known = true;
  out.calibration = of_rig;
  if (out.info.rig.empty()) out.info.rig = rig.rig;
  const bool keep = !proven && !recorded.empty();
  if (!keep) recorded = sha256_of_text(of_rig);
  return same     ? "the SHA-256 of its calibration is damaged, rig.yaml says the same calibration"
         : proven ? changed + "the recorded calibration is in rig.yaml (its SHA-256 is right)"
                  : std::string("cameras and calibration are taken from rig.yaml, ") + kNotProven;
}

}  // namespace

void examine_session_yaml(Examination& so_far, const DescribeRig& describe) {
  const fs::path& session = so_far.session;
  SessionFindings& out = so_far;
  const fs::path file = session / "session.yaml";
  std::error_code ignored;
  const bool there = fs::is_regular_file(file, ignored);
  const std::string text = there ? read_whole_file(file) : "";
  std::string why = "missing";
  std::vector<std::string> lost;
  out.calibration = recorded_calibration(text);
  if (there) try {
      out.info = read_session_yaml(file);
      out.info_known = true;
      why = "";
    } catch (const InputError& e) {
      why = "cannot be read (" + within(session, e.what()) + ")";
      Salvage salvaged(text, file);
      out.info = std::move(salvaged.info), lost = std::move(salvaged.lost);
    }
  const std::string of_calibration = find_calibration(session, describe, out);
  if (why.empty() && (of_calibration.empty() || (of_calibration == kNotProven && told_before(out.info)))) {
    if (out.info.status == "recording") out.losses.push_back("session.yaml: the recording never reached its end");
    return;
  }
  out.info_damaged = true;
  why += (why.empty() || of_calibration.empty() ? "" : "; ") + of_calibration;
  if (!there && out.info_known) why += "; when, by whom and in what light it was recorded is lost";
  for (const std::string& key : lost) why += (&key == &lost.front() ? "; lost, as far as there was any: " : ", ") + key;
  so_far.lose("session.yaml", why);
  if (out.info.name.empty()) out.info.name = fs::absolute(session).lexically_normal().filename().string();
  if (out.info.status.empty()) out.info.status = "recording";
  if (out.info.kind.empty()) out.info.kind = "scan";
}

}  // namespace tankrig
