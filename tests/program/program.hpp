// Runs the tankrig program and keeps what it said.
#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

namespace tankrig::test {

struct ProgramRun {
  int exit_code = -1;
  std::string out, err;

  nlohmann::json json() const { return nlohmann::json::parse(out); }
};

/// Runs `tankrig arguments...` in the source folder. `on_error_line` sees every line of standard error as it comes,
/// with the program's pid. `one_core` keeps the program, and so its threads, on a single processor.
ProgramRun run_tankrig(const std::vector<std::string>& arguments,
                       const std::function<void(const std::string&, int)>& on_error_line = {}, bool one_core = false);

/// Did it fail because this machine forbids the network of their own that emulated cameras need?
bool forbids_private_network(const ProgramRun& run);

/// An empty folder of the running test's own.
std::filesystem::path scratch_folder();

void write_text(const std::filesystem::path& file, const std::string& text);
std::string read_text(const std::filesystem::path& file);

using Edits = std::vector<std::pair<std::string, std::string>>;

/// Replaces the first occurrence of every first text by the second.  Fails the test if one is not there.
void edit(const std::filesystem::path& file, const Edits& edits);

/// The rig.yaml of a copy of the tank-sim rig in `folder`, complete, with one edit.
std::filesystem::path edited_rig(const std::filesystem::path& folder, const std::string& from, const std::string& to);

/// The same with a tenth of the sweep and few dark frames.
std::filesystem::path small_sweep_rig(const std::filesystem::path& folder);

/// Makes a copy's stereo pictures so many times smaller, 160 x 120 where nothing asks for stereo's figures: a small scan
/// takes half the time.
void shrink_stereo_pictures(const std::filesystem::path& rig, int times = 4);
/// Likewise 360 x 288.
void shrink_mono_pictures(const std::filesystem::path& rig);

/// A small sweep and small pictures, mono 360 x 288, stereo 160 x 120; `edits` are made after that.
std::filesystem::path small_rig(const std::filesystem::path& folder, const Edits& edits = {});

/// The tank-wire rig file's watchdog box: its two lines.
inline constexpr const char* kShippedBox[] = {"heartbeat_output: {kind: bytes, device: runtime/box}",
                                              "enable_input: {kind: reply, wait_s: 60}"};

/// The rig.yaml of a copy of the tank-wire rig in `folder`, patient with a machine that starves its emulators and without
/// its watchdog box, which is patient with nobody, with `edits` made after that.
std::filesystem::path patient_wire_rig(const std::filesystem::path& folder, const Edits& edits = {});

}  // namespace tankrig::test
