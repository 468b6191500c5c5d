// Runs the tankrig program and keeps what it said.
#include "tests/program/program.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <sstream>

namespace fs = std::filesystem;

namespace tankrig::test {

ProgramRun run_tankrig(const std::vector<std::string>& arguments,
                       const std::function<void(const std::string&, int)>& on_error_line, bool one_core) {
  static std::atomic<int> runs = 0;
  const fs::path out_file = scratch_folder() / ("stdout" + std::to_string(++runs) + ".txt");
  int error_pipe[2];
  if (pipe2(error_pipe, O_CLOEXEC) != 0) throw std::runtime_error("pipe failed");
  const pid_t pid = fork();
  if (pid == 0) {
    std::vector<char*> argv{const_cast<char*>(TANKRIG_PROGRAM)};
    for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
    argv.push_back(nullptr);
    if (one_core) {
      cpu_set_t first;
      CPU_ZERO(&first);
      CPU_SET(0, &first);
      if (sched_setaffinity(0, sizeof first, &first) != 0) _exit(125);
    }
    dup2(error_pipe[1], STDERR_FILENO);
    dup2(open(out_file.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644), STDOUT_FILENO);
    if (chdir(TANKRIG_SOURCE_DIR) != 0) _exit(126);
    execv(TANKRIG_PROGRAM, argv.data());
    _exit(127);
  }
  close(error_pipe[1]);
  ProgramRun run;
  FILE* errors = fdopen(error_pipe[0], "r");
  char line[4096];
  while (std::fgets(line, sizeof line, errors)) {
    run.err += line;
    if (on_error_line) on_error_line(line, pid);
  }
  std::fclose(errors);
  int status = 0;
  waitpid(pid, &status, 0);
  run.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  run.out = read_text(out_file);
  return run;
}

bool forbids_private_network(const ProgramRun& run) {
  const auto told = [&](const char* words) { return run.err.find(words) != std::string::npos; };
  return run.exit_code != 0 && told("private network: ") && !told("before the first thread");
}

fs::path scratch_folder() {
  const auto* test = testing::UnitTest::GetInstance()->current_test_info();
  const fs::path folder = fs::path(testing::TempDir()) / ("tankrig-" + std::to_string(getpid())) /
                          (test ? std::string(test->test_suite_name()) + "." + test->name() : std::string("suite"));
  fs::create_directories(folder);
  return folder;
}

void write_text(const fs::path& file, const std::string& text) { std::ofstream(file, std::ios::binary) << text; }

std::string read_text(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return text.str();
}

void edit(const fs::path& file, const Edits& edits) {
  std::string text = read_text(file);
  for (const auto& [from, to] : edits) {
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << file << " does not say: " << from;
    if (at != std::string::npos) text.replace(at, from.size(), to);
  }
  write_text(file, text);
}

fs::path edited_rig(const fs::path& folder, const std::string& from, const std::string& to) {
  static const fs::path made = [] {
    const fs::path rig = scratch_folder().parent_path() / "made" / "rig";
    fs::create_directories(rig.parent_path());
    EXPECT_EQ(run_tankrig({"init", rig.string()}).exit_code, 0);
    return rig;
  }();
  fs::copy(made, folder, fs::copy_options::recursive);
  edit(folder / "rig.yaml", {{from, to}});
  return folder / "rig.yaml";
}

void shrink_stereo_pictures(const fs::path& rig, int times) {
  // 0 is the middle of the first pixel: centres count from its edge, half a pixel before.
  const auto eye = [](int factor) {
    const double f = factor;
    std::ostringstream out;
    out << "width_px: " << 640 / factor << ", height_px: " << 480 / factor << ", fx_px: " << 765.4 / f
        << ", fy_px: " << 762.9 / f << ", cx_px: " << 316.2 / f - 0.5 << ", cy_px: " << 237.3 / f - 0.5;
    return out.str();
  };
  const auto size_in_scene = [](int factor) {
    return "<resw>" + std::to_string(640 / factor) + "</resw><resh>" + std::to_string(480 / factor) + "</resh>";
  };
  const auto lens_in_scene = [](double f) {
    std::ostringstream out;
    out << "<fx>" << 765.4 / f << "</fx><fy>" << 762.9 / f << "</fy><x0>" << 316.2 / f - 0.5 << "</x0><y0>"
        << 237.3 / f - 0.5 << "</y0>";
    return out.str();
  };
  for (int eyes = 0; eyes < 2; ++eyes) {
    edit(rig, {{eye(1), eye(times)}});
    edit(rig.parent_path() / "tank.xml",
         {{size_in_scene(1), size_in_scene(times)}, {lens_in_scene(1), lens_in_scene(times)}});
  }
  edit(rig, {{"\nscan:\n", "\nscan:\n  safety: {beam: {waived: [left, right]}}\n"}});  // too small to be witnesses
}

void shrink_mono_pictures(const fs::path& rig) {
  edit(rig, {{"width_px: 720, height_px: 576, fx_px: 626.08, fy_px: 682.78, cx_px: 368.93, cy_px: 284.83",
              "width_px: 360, height_px: 288, fx_px: 313.04, fy_px: 341.39, cx_px: 184.215, cy_px: 142.165"}});
  edit(rig.parent_path() / "tank.xml", {{"<resw>720</resw><resh>576</resh>", "<resw>360</resw><resh>288</resh>"},
                                        {"<fx>626.08</fx><fy>682.78</fy><x0>368.93</x0><y0>284.83</y0>",
                                         "<fx>313.04</fx><fy>341.39</fy><x0>184.215</x0><y0>142.165</y0>"}});
}

fs::path small_sweep_rig(const fs::path& folder) {
  const fs::path rig = edited_rig(folder, "from_rad: 1.3\n", "from_rad: 1.68\n");
  edit(rig, {{"to_rad: 2.1", "to_rad: 1.76"}, {"dark_frames: 10", "dark_frames: 2"}});
  return rig;
}

fs::path small_rig(const fs::path& folder, const Edits& edits) {
  const fs::path rig = small_sweep_rig(folder);
  shrink_stereo_pictures(rig);
  shrink_mono_pictures(rig);
  edit(rig, edits);
  return rig;
}

fs::path patient_wire_rig(const fs::path& folder, const Edits& edits) {
  EXPECT_EQ(run_tankrig({"init", folder.string(), "--from", "tank-wire"}).exit_code, 0);
  edit(folder / "rig.yaml",
       {{"\nscan:\n", "\nscan:\n  control: {feedback_timeout_s: 1, heartbeat_timeout_s: 1}\n"},
        {"guardian_timeout_s: 0.25 ", "camera_timeout_s: 10\n    guardian_timeout_s: 5 "},
        {kShippedBox[0], "heartbeat_output: {kind: none}"},
        {kShippedBox[1], "enable_input: {kind: none}"},
        {"limit: 100,", "limit: 0,"},
        {"reply_timeout_ms: 5 ", "silence_timeout_ms: 1000\n    watchdog_ms: 10000\n    reply_timeout_ms: 100 "},
        {"mono: {driver: aravis,", "mono: {driver: aravis, stall_periods: 250,"},
        {"left: {driver: aravis,", "left: {driver: aravis, stall_periods: 250,"},
        {"right: {driver: aravis,", "right: {driver: aravis, stall_periods: 250,"},
        {"answer_timeout_ms: 200", "answer_timeout_ms: 1000, caller_timeout_ms: 5000, opening_timeout_s: 20"}});
  edit(folder / "rig.yaml", edits);
  return folder / "rig.yaml";
}

}  // namespace tankrig::test
