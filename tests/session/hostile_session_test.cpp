// Sessions that somebody made to lead whoever opens them elsewhere: by names, links, spooled frames, or files that
// never end.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <thread>

#include "core/input_error.hpp"
#include "core/session_names.hpp"
#include "core/text_files.hpp"
#include "session/checking/checksums.hpp"
#include "session/checking/session_recover.hpp"
#include "session/reading/session_folder.hpp"
#include "session/recording/session_lock.hpp"
#include "session/recording/spool.hpp"
#include "tests/session/in_memory.hpp"
#include "tests/session/some_session.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

const std::vector<std::string> kNotAPicture{"../x.png",
                                            "/tmp/x.png",
                                            "rig.yaml",
                                            "session.yaml",
                                            "frames/mono/../../rig.yaml",
                                            "frames/mono/..",
                                            "frames/mono/",
                                            "frames/mono//x.png",
                                            "frames/mono/./x.png",
                                            "frames/left/x.png",
                                            "frames/mono/\x1b[2J.png"};

std::string error_of_opening(const fs::path& path) {
  return message_of<InputError>([&] { Session::open(path); });
}

void replace_in(const fs::path& file, const std::string& from, const std::string& to) {
  std::string text = read_whole_file(file);
  const std::size_t at = text.find(from);
  ASSERT_NE(at, std::string::npos) << from;
  write_whole_file(file, text.replace(at, from.size(), to));
}

fs::path sealed(const TemporaryFolder& folder) {
  const fs::path path = recorded(folder, 3);
  write_checksums(path);
  return path;
}

TEST(HostileSession, NamesOfPicturesStayBelowTheFolderOfTheirCamera) {
  for (const std::string& name : kNotAPicture) EXPECT_FALSE(is_picture_name(name, "mono")) << name;
  for (const char* name : {"frames/mono/000000.png",
                           "frames/mono/dark/Gr\xc3\xb6\xc3\x9f"
                           "e (1).JPG",
                           "frames/mono/.a"})
    EXPECT_TRUE(is_picture_name(name, "mono")) << name;
}

TEST(HostileSession, OfACameraNamedElsewhereIsNotOpened) {
  for (const char* name : {"../../evil", "/tmp/evil", "..", ".", "", "a/b", "a\x1b[31m"}) {
    const InMemory in_memory;
    const TemporaryFolder folder;
    const fs::path path = sealed(folder);
    replace_in(path / "session.yaml", "- name: \"mono\"", "- name: " + yaml_quoted(name));
    EXPECT_THAT(error_of_opening(path), testing::ContainsRegex("session.yaml:[0-9]+: cameras.0..name: found '"))
        << name;
    EXPECT_FALSE(examine_session(path, {}).info_known) << name;
  }
}

TEST(HostileSession, OfAMeshElsewhereIsNotOpened) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const fs::path path = sealed(folder);
  replace_in(path / "session.yaml", "mesh: \"box.obj\"", "mesh: \"../../etc/passwd\"");
  EXPECT_THAT(error_of_opening(path), HasSubstr("mesh: found '../../etc/passwd', expected the name of a file"));
}

TEST(HostileSession, WhoseSpoolNamesOtherFilesOverwritesNone) {
  for (const std::string& name : kNotAPicture) {
    const InMemory in_memory;
    const TemporaryFolder folder;
    const fs::path path = recorded(folder, 3);
    const std::string rig = "the rig as it was\n", yaml = read_whole_file(path / "session.yaml");
    write_whole_file(path / "rig.yaml", rig);
    fs::create_directory(path / "spool");
    FrameRecord crafted = some_frame(3);
    crafted.file = name;
    SpoolWriter(path / "spool/000000.raw").append(3, frames_line(crafted), test_image(3));
    recover_session(path, {});
    EXPECT_EQ(read_whole_file(path / "rig.yaml"), rig) << name;
    EXPECT_THAT(read_whole_file(path / "session.yaml"), testing::StartsWith("format: tankrig-session 1")) << name;
    EXPECT_THAT(read_whole_file(path / "lost+found/1/session.yaml"), yaml);
    EXPECT_EQ(Session::open(path).frames.size(), 3u) << name;
    EXPECT_TRUE(fs::exists(path / "lost+found/1/spool/000000.raw")) << "kept as it is";
  }
}

TEST(HostileSession, WhoseSpoolHasFramesOfAnotherCameraIsWholeWithoutThem) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const fs::path path = recorded(folder, 3);
  fs::create_directory(path / "spool");
  {
    FrameRecord crafted = some_frame(4);
    crafted.camera = "ghost";
    crafted.file = "frames/ghost/000004.png";
    SpoolWriter spool(path / "spool/000000.raw");
    spool.append(3, frames_line(filed_frame(3)), test_image(3));
    spool.append(4, frames_line(crafted), test_image(4));
  }
  recover_session(path, {});
  EXPECT_EQ(Session::open(path).frames.size(), 4u);
  EXPECT_FALSE(fs::exists(path / "frames/ghost"));
  EXPECT_TRUE(fs::exists(path / "lost+found/1/spool/000000.raw")) << "kept as it is";
  EXPECT_TRUE(examine_session(path, {}).whole());
}

TEST(HostileSession, WhoseSpoolNamesAPictureThatIsThereKeepsIt) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const fs::path path = sealed(folder);
  const std::string picture = read_whole_file(path / "frames/mono/000001.png"),
                    same = read_whole_file(path / "frames/mono/000000.png");
  fs::create_directory(path / "spool");
  {
    SpoolWriter spool(path / "spool/000000.raw");
    spool.append(0, frames_line(filed_frame(0)), test_image(0));
    spool.append(1, frames_line(filed_frame(1)), test_image(7));
    spool.append(2, frames_line(filed_frame(1)), test_image(8));
  }
  const Recovery done = recover_session(path, {});
  EXPECT_THAT(done.found.losses, testing::Contains("spool/000000.raw: 1 frame without a proper line of its own"));
  EXPECT_EQ(read_whole_file(path / "lost+found/1/frames/mono/000001.png"), picture);
  EXPECT_FALSE(fs::exists(path / "lost+found/1/frames/mono/000000.png")) << "it is what the spool has";
  EXPECT_EQ(read_whole_file(path / "frames/mono/000000.png"), same);
  EXPECT_TRUE(examine_session(path, {}).whole());
}

TEST(HostileSession, WithALinkInItIsRefusedAndNothingBehindTheLinkIsTouched) {
  for (const char* link : {"clouds", "results", "pictures", "lost+found", "frames/mono", "frames", "spool",
                           "joints.csv", "frames/mono/000001.png", "report.html"}) {
    SCOPED_TRACE(link);
    const InMemory in_memory;
    const TemporaryFolder folder;
    const fs::path path = sealed(folder), elsewhere = folder.path() / "elsewhere";
    if (fs::exists(path / link))
      fs::rename(path / link, elsewhere);
    else
      fs::create_directory(elsewhere);
    if (std::string(link) == "spool")
      SpoolWriter(elsewhere / "000000.raw").append(0, frames_line(filed_frame(0)), test_image(0));
    const auto listing = [&] {
      std::vector<std::string> files;
      if (fs::is_directory(elsewhere))
        for (const auto& entry : fs::recursive_directory_iterator(elsewhere)) files.push_back(entry.path());
      std::sort(files.begin(), files.end());
      return files;
    };
    const std::vector<std::string> before = listing();
    fs::create_symlink(elsewhere, path / link);
    const auto refused = HasSubstr("s/" + std::string(link) + ": is a symbolic link, expected a session that is all");
    EXPECT_THAT(error_of_opening(path), refused);
    EXPECT_THAT(message_of<InputError>([&] { examine_session(path, {}); }), refused);
    EXPECT_THAT(message_of<InputError>([&] { recover_session(path, {}); }), refused);
    RecoverOptions copy;
    copy.out = folder.path() / "copy";
    EXPECT_THAT(message_of<InputError>([&] { recover_session(path, copy); }), refused);
    EXPECT_FALSE(fs::exists(copy.out));
    EXPECT_EQ(listing(), before);
  }
}

TEST(HostileSession, IsReadAndWrittenFolderByFolderWithoutFollowingALink) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  folder.write("elsewhere/secret.png", "secret");
  fs::create_directories(folder.path() / "s/frames");
  fs::create_directory_symlink(folder.path() / "elsewhere", folder.path() / "s/frames/mono");
  const auto error = [&](const auto& action) { return message_of<InputError>(action); };
  const fs::path session = folder.path() / "s";
  EXPECT_THAT(error([&] { read_below(session, "frames/mono/secret.png", 100, "an image"); }),
              HasSubstr("cannot be read"));
  EXPECT_THAT(error([&] { read_below(session, "../elsewhere/secret.png", 100, "an image"); }),
              HasSubstr("leads outside"));
  EXPECT_THAT(error([&] { place_below(session, "frames/mono/a.png"); }), HasSubstr("frames/mono: cannot be written"));
  EXPECT_THAT(error([&] { place_below(session, "/frames/a.png"); }), HasSubstr("leads outside"));
  EXPECT_EQ(place_below(session, "frames/left/deep/a.png"), session / "frames/left/deep/a.png");
  EXPECT_TRUE(fs::is_directory(session / "frames/left/deep"));
}

TEST(HostileSession, WithAPipeInPlaceOfAFileIsToldAtOnce) {
  for (const char* file : {"session.yaml", "frames.csv", "joints.csv", "events.csv", "rig.yaml", "SHA256SUMS",
                           "spool/000000.raw", "frames/mono/000001.png"}) {
    SCOPED_TRACE(file);
    const InMemory in_memory;
    const TemporaryFolder folder;
    const fs::path path = sealed(folder);
    fs::remove(path / file);
    fs::create_directories((path / file).parent_path());
    ASSERT_EQ(::mkfifo((path / file).c_str(), 0600), 0);
    const std::string said = message_of<InputError>([&] {
      const SessionFindings found = examine_session(path, {});
      throw InputError(testing::PrintToString(found.losses) + testing::PrintToString(found.missing()));
    });
    EXPECT_THAT(said, HasSubstr(std::string(file) == "frames/mono/000001.png" ? "without a whole picture" : file));
    const std::string opening = message_of<InputError>([&] {
      const Session session = Session::open(path);
      session.image(session.frames.at(1));
    });
    if (std::string(file) == "session.yaml" || std::string(file).starts_with("frames")) {
      EXPECT_THAT(opening, HasSubstr(std::string(file) + ": is a pipe, a socket or a device, expected"));
    }
  }
}

TEST(HostileSession, WhoseFilesCannotBeReadIsMendedWithoutThem) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const fs::path path = sealed(folder), picture = path / "frames/mono/000001.png";
  fs::create_directory(path / "spool");
  ASSERT_EQ(::mkfifo((path / "spool/x.raw").c_str(), 0600), 0);
  fs::remove(picture);
  fs::create_directory(picture);
  const Recovery done = recover_session(path, {});
  EXPECT_TRUE(done.finished);
  EXPECT_THAT(done.found.losses, testing::Contains(HasSubstr("spool/x.raw: cannot be read (spool/x.raw: is a pipe")));
  EXPECT_THAT(done.found.losses, testing::Contains(HasSubstr("camera mono: 1 frame without a whole picture")));
  EXPECT_EQ(Session::open(path).frames.size(), 2u);
  EXPECT_TRUE(fs::exists(path / "lost+found/1/spool/x.raw"));
  EXPECT_TRUE(fs::is_directory(path / "lost+found/1/frames/mono/000001.png"));
  EXPECT_TRUE(examine_session(path, {}).whole());
}

TEST(HostileSession, WithAPictureOfAnySizeIsExamined) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const fs::path path = recorded(folder, 3);
  fs::resize_file(path / "frames/mono/000001.png", (std::uint64_t{64} << 30) + 1);  // takes no room
  EXPECT_THAT(examine_session(path, {}).losses,
              testing::Contains(HasSubstr("camera mono: 1 frame without a whole picture")));
}

TEST(HostileSession, WithAPictureOfAnotherSizeIsRefusedBeforeItIsDecoded) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const fs::path path = sealed(folder);
  write_whole_file(path / "frames/mono/000001.png",
                   "\x89PNG\r\n\x1a\n" + std::string("\0\0\0\rIHDR\0\1\x86\xa0\0\1\x86\xa0", 16));
  const Session session = Session::open(path);
  EXPECT_THAT(message_of<InputError>([&] { session.image(session.frames[1]); }),
              HasSubstr("000001.png: found 100000 x 100000 px, expected 8 x 6 as calibrated"));
}

TEST(SessionLock, WaitsForWhoOnlyHasALook) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  std::optional<SessionLock> look(std::in_place, folder.path(), SessionUse::kRead);
  EXPECT_THAT(message_of<InputError>([&] { SessionLock(folder.path(), SessionUse::kWrite, Duration{}); }),
              HasSubstr("is being written or read by another process"));
  std::thread leaves([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    look.reset();
  });
  EXPECT_NO_THROW(SessionLock(folder.path(), SessionUse::kWrite, std::chrono::minutes(1)));
  leaves.join();
}

}  // namespace
}  // namespace tankrig
