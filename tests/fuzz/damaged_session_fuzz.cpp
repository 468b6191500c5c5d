// A session with one file of anything: `session check` finds something to say, or that nothing is lost. The first byte
// chooses the file.
#include <array>
#include <cstdlib>

#include "core/input_error.hpp"
#include "core/text_files.hpp"
#include "session/checking/session_findings.hpp"
#include "session/reading/session_tables.hpp"
#include "session/reading/session_yaml.hpp"
#include "tests/fuzz/scratch_file.hpp"

using namespace tankrig;

namespace {

constexpr std::array kFiles{
    "session.yaml",          "joints.csv", "events.csv", "frames.csv", "SHA256SUMS", "spool/000000.raw",
    "frames/mono/000000.png"};

/// Every file of kFiles, small and good, but for spool and seal: there are none.
void write_session(const std::filesystem::path& folder) {
  SessionInfo info;
  info.name = "s", info.status = "complete", info.kind = "import";
  info.cameras = {{"mono", CameraRole::kMono, {8, 6, 10, 10, 3.5, 2.5}, Transform::Identity()}};
  for (const char* inside : {"spool", "frames/mono"}) std::filesystem::create_directories(folder / inside);
  write_whole_file(folder / "session.yaml", session_yaml(info));
  write_whole_file(folder / "joints.csv", joints_header());
  write_whole_file(folder / "events.csv", events_header());
  FrameRecord frame;
  frame.camera = "mono", frame.file = "frames/mono/000000.png";
  write_whole_file(folder / "frames.csv", frames_header() + frames_line(frame));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  if (size == 0) return 0;
  static const fuzzing::ScratchFolder folder;
  write_session(folder.path());
  for (const char* file : {"SHA256SUMS", "spool/000000.raw", "frames/mono/000000.png"})
    std::filesystem::remove(folder.path() / file);
  folder.put(kFiles[bytes[0] % kFiles.size()], bytes + 1, size - 1);
  return fuzzing::refused_or_parsed<InputError>([&] {
    const SessionFindings found = examine_session(folder.path(), {});
    if (found.whole() && !found.sealed) std::abort();
    if (found.usable() && found.info.cameras.empty()) std::abort();
    for (const std::string& loss : found.losses)
      if (loss.find('\n') != std::string::npos) std::abort();
  });
}
