// Sessions out of other people's photographs.
#include "session/import/session_import.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "core/input_error.hpp"
#include "session/checking/checksums.hpp"
#include "session/checking/session_findings.hpp"
#include "session/import/planes_csv.hpp"
#include "session/reading/picture_file.hpp"
#include "session/reading/session.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr CameraModel kCamera{8, 6, 10, 11, 3.5, 2.5};

void put_image(const TemporaryFolder& folder, const std::string& name, int value) {
  fs::create_directories((folder.path() / name).parent_path());
  cv::imwrite((folder.path() / name).string(), cv::Mat(6, 8, CV_8UC3, cv::Scalar::all(value)));
}

ImportRequest request_in(const TemporaryFolder& folder) {
  ImportRequest request;
  request.images = folder.path() / "in";
  request.camera = kCamera;
  request.plane = parse_plane("0,0,2,-1");
  request.out = folder.path() / "out";
  return request;
}

TEST(NaturalOrder, CountsAsPeopleDo) {
  std::vector<std::string> names{"f10.png", "f2.png", "f1.png", "f02b.png", "10.png", "9.png", "a.png"};
  std::sort(names.begin(), names.end(), natural_less);
  EXPECT_THAT(names, testing::ElementsAre("9.png", "10.png", "a.png", "f1.png", "f2.png", "f02b.png", "f10.png"));
  EXPECT_FALSE(natural_less("a1", "a1"));
  EXPECT_NE(natural_less("a1", "a01"), natural_less("a01", "a1"));
}

TEST(ImportSession, KeepsImagesAsTheyAreInNaturalOrderWithDarkOnesAfter) {
  const TemporaryFolder folder;
  put_image(folder, "in/img10.jpg", 10);
  put_image(folder, "in/img9.png", 9);
  folder.write("in/readme.txt", "not an image");
  put_image(folder, "dark/img9.png", 1);
  ImportRequest request = request_in(folder);
  request.dark = folder.path() / "dark";
  write_import_session(request);

  const Session session = Session::open(request.out);
  EXPECT_TRUE(session.warnings.empty());
  EXPECT_EQ(session.info.kind, "import");
  EXPECT_EQ(session.info.status, "complete");
  EXPECT_FALSE(session.info.calibration.arm);
  ASSERT_EQ(session.frames.size(), 3u);
  EXPECT_EQ(session.frames[0].file, "frames/mono/img9.png");
  EXPECT_EQ(session.frames[1].file, "frames/mono/img10.jpg");
  EXPECT_EQ(session.frames[2].file, "frames/mono/dark/img9.png");
  EXPECT_EQ(session.frames[2].phase, Phase::kDarkBefore);
  EXPECT_FALSE(session.frames[2].laser_on);
  EXPECT_FALSE(session.frames[2].cPl);
  EXPECT_EQ(session.laser_plane(session.frames[1]).offset, -0.5);
  EXPECT_EQ(session.image(session.frames[2]).at<cv::Vec3b>(0, 0)[0], 1);
  EXPECT_EQ(folder.read("out/frames/mono/img10.jpg"), folder.read("in/img10.jpg"));
  EXPECT_TRUE(compare_checksums(request.out).empty());
}

TEST(ImportSession, IsDamagedWithAJpegThatIsCutSealedOrNot) {
  for (const bool sealed : {true, false}) {
    const TemporaryFolder folder;
    cv::Mat noise(600, 800, CV_8UC3);
    cv::randu(noise, 0, 255);
    fs::create_directory(folder.path() / "in");
    cv::imwrite((folder.path() / "in/a.jpg").string(), noise);
    cv::imwrite((folder.path() / "in/b.JPG").string(), noise);
    ImportRequest request = request_in(folder);
    request.camera = {800, 600, 1000, 1000, 400, 300};
    write_import_session(request);
    if (!sealed) fs::remove(request.out / "SHA256SUMS");
    EXPECT_THAT(examine_session(request.out, {}).losses, testing::IsEmpty());
    const fs::path cut = request.out / "frames/mono/b.JPG";
    fs::resize_file(cut, fs::file_size(cut) * 2 / 3);
    ASSERT_FALSE(cv::imread(cut.string()).empty()) << "decoded all the same";
    EXPECT_THAT(examine_session(request.out, {}).losses,
                testing::ElementsAre(HasSubstr("camera mono: 1 frame without a whole picture")));
  }
}

TEST(WholeJpeg, EndsWithTheEndOfItsImageWhateverFollows) {
  std::vector<unsigned char> coded;
  cv::Mat noise(64, 64, CV_8UC3);
  cv::randu(noise, 0, 255);
  for (const int progressive : {0, 1}) {
    cv::imencode(".jpg", noise, coded, {cv::IMWRITE_JPEG_PROGRESSIVE, progressive, cv::IMWRITE_JPEG_RST_INTERVAL, 4});
    const std::string jpeg(coded.begin(), coded.end());
    EXPECT_TRUE(is_whole_jpeg(jpeg));
    EXPECT_TRUE(is_whole_jpeg(jpeg + "a maker's own notes"));
    for (std::size_t bytes = 0; bytes < jpeg.size(); ++bytes)
      ASSERT_FALSE(is_whole_jpeg(std::string_view(jpeg).substr(0, bytes))) << bytes << " of " << jpeg.size();
  }
}

TEST(ImportSession, RefusesAJpegThatIsCutShort) {
  const TemporaryFolder folder;
  cv::Mat noise(600, 800, CV_8UC3);
  cv::randu(noise, 0, 255);
  fs::create_directory(folder.path() / "in");
  const fs::path cut = folder.path() / "in/a.jpg";
  cv::imwrite(cut.string(), noise);
  fs::resize_file(cut, fs::file_size(cut) * 2 / 3);
  ASSERT_FALSE(cv::imread(cut.string()).empty()) << "decoded all the same";
  ImportRequest request = request_in(folder);
  request.camera = {800, 600, 1000, 1000, 400, 300};
  EXPECT_THAT(message_of<InputError>([&] { write_import_session(request); }),
              HasSubstr("a.jpg: is a JPEG that is cut short, expected a whole one"));
}

TEST(ImportSession, NamesCountsAndLeavesOutWhatIsNoWholePicture) {
  const TemporaryFolder folder;
  for (const char* name : {"in/a.png", "in/cut.png", "in/flipped.bmp", "in/z.ppm", "dark/a.png", "dark/b.png"})
    put_image(folder, name, 1);
  fs::resize_file(folder.path() / "in/cut.png", fs::file_size(folder.path() / "in/cut.png") / 2);
  fs::resize_file(folder.path() / "in/flipped.bmp", fs::file_size(folder.path() / "in/flipped.bmp") - 1);
  fs::resize_file(folder.path() / "dark/b.png", 0);
  folder.write("in/text.png", "not a picture");
  ImportRequest request = request_in(folder);
  request.dark = folder.path() / "dark";
  EXPECT_THAT(write_import_session(request),
              testing::ElementsAre(HasSubstr("in/cut.png: is a PNG that is cut short or damaged"),
                                   HasSubstr("in/flipped.bmp: is cut short: found "),
                                   HasSubstr("in/text.png: cannot be decoded, expected an image"),
                                   HasSubstr("dark/b.png: is empty, expected an image")));
  const Session session = Session::open(request.out);
  ASSERT_EQ(session.frames.size(), 3u);
  EXPECT_EQ(session.frames[0].file, "frames/mono/a.png");
  EXPECT_EQ(session.frames[1].file, "frames/mono/z.ppm");
  EXPECT_EQ(session.frames[1].index, 1);
  EXPECT_EQ(session.frames[2].file, "frames/mono/dark/a.png");
  EXPECT_EQ(session.info.counts.at("mono.recorded"), 3u);
  EXPECT_EQ(session.info.counts.at("mono.left_out"), 4u);
  EXPECT_FALSE(fs::exists(request.out / "frames/mono/cut.png"));
  EXPECT_THAT(folder.read("out/events.csv"), HasSubstr("left_out"));
  EXPECT_THAT(folder.read("out/events.csv"), HasSubstr("in/text.png: cannot be decoded"));
  EXPECT_THAT(examine_session(request.out, {}).losses, testing::IsEmpty());
}

TEST(ImportSession, IsNotOpenedWithAPlaneInMillimetres) {
  const TemporaryFolder folder;
  put_image(folder, "in/a.png", 1);
  write_import_session(request_in(folder));
  std::string frames = folder.read("out/frames.csv");
  const std::size_t at = frames.find(",0,0,1,-0.5,");
  ASSERT_NE(at, std::string::npos) << frames;
  folder.write("out/frames.csv", frames.replace(at, 12, ",0,0,1,-500,"));
  EXPECT_THAT(message_of<InputError>([&] { Session::open(folder.path() / "out"); }),
              HasSubstr("frames.csv:2: plane_d_m: found '-500', expected metres, at most a tank's length (20); looks "
                        "like millimetres"));
}

TEST(ImportSession, RefusesAFolderWithoutAWholePicture) {
  const TemporaryFolder folder;
  for (const char* name : {"in/a.png", "in/b.png"}) folder.write(name, "");
  EXPECT_THAT(message_of<InputError>([&] { write_import_session(request_in(folder)); }),
              HasSubstr("in: holds no image that is whole, expected one; of 2 the first: "));
  EXPECT_FALSE(fs::exists(folder.path() / "out"));
}

TEST(ImportSession, ReadsNoHalfOfAPictureThatWasCutLater) {
  const TemporaryFolder folder;
  for (const char* name : {"in/a.png", "in/b.jpg", "in/c.bmp", "in/d.tif", "in/e.ppm"}) put_image(folder, name, 1);
  const ImportRequest request = request_in(folder);
  write_import_session(request);
  const Session session = Session::open(request.out);
  ASSERT_EQ(session.frames.size(), 5u);
  for (const FrameRecord& frame : session.frames) {
    EXPECT_EQ(session.image(frame).size(), cv::Size(8, 6)) << frame.file;
    const fs::path file = request.out / frame.file;
    fs::resize_file(file, fs::file_size(file) - 3);
    EXPECT_THROW(session.image(frame), DamagedPicture) << frame.file;
  }
}

TEST(ImportSession, RemovesNothingThatIsNotItsOwn) {
  const TemporaryFolder folder;
  put_image(folder, "in/a.png", 1);
  for (const char* mine : {".out.tmp/diary", ".out.1.tmp/diary", ".out.2.tmp"}) folder.write(mine, "mine");
  write_import_session(request_in(folder));
  for (const char* mine : {".out.tmp/diary", ".out.1.tmp/diary", ".out.2.tmp"}) EXPECT_EQ(folder.read(mine), "mine");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()), 5) << "and 'in' and 'out'";
}

TEST(ImportSession, TakesThePlaneOfEachImageByItsName) {
  const TemporaryFolder folder;
  put_image(folder, "in/a.png", 1);
  put_image(folder, "in/b.png", 2);
  ImportRequest request = request_in(folder);
  request.plane.reset();
  request.planes = {{"b.png", {Vector3d::UnitX(), 2}}, {"a.png", {Vector3d::UnitY(), 1}}};
  write_import_session(request);
  const Session session = Session::open(request.out);
  EXPECT_EQ(session.laser_plane(session.frames[0]).offset, 1);
  EXPECT_EQ(session.laser_plane(session.frames[1]).offset, 2);
}

TEST(ImportSession, RefusesDarkImagesOfAnotherKind) {
  const TemporaryFolder folder;
  put_image(folder, "in/a.png", 1);
  fs::create_directories(folder.path() / "dark");
  ImportRequest request = request_in(folder);
  request.dark = folder.path() / "dark";
  const auto error_with = [&](int type) {
    cv::imwrite((folder.path() / "dark/b.png").string(), cv::Mat(6, 8, type, cv::Scalar::all(1)));
    return message_of<InputError>([&] { write_import_session(request); });
  };
  EXPECT_THAT(error_with(CV_8UC1), HasSubstr("dark/b.png: found 1 x 8 bits a pixel, expected 3 x 8 bits as in a.png"));
  EXPECT_THAT(error_with(CV_16UC3),
              HasSubstr("dark/b.png: found 3 x 16 bits a pixel, expected 3 x 8 bits as in a.png"));
  EXPECT_FALSE(fs::exists(request.out));
  EXPECT_EQ(error_with(CV_8UC3), "no error");
}

TEST(ImportSession, RefusesToLieAmongItsOwnImages) {
  const TemporaryFolder folder;
  put_image(folder, "in/a.png", 1);
  put_image(folder, "dark/a.png", 1);
  fs::create_directory_symlink(folder.path() / "in", folder.path() / "link");
  ImportRequest request = request_in(folder);
  request.dark = folder.path() / "dark";
  for (const char* out : {"in/s", "dark/deep/s", "in/../in/s", "link/s"}) {
    request.out = folder.path() / out;
    EXPECT_THAT(message_of<InputError>([&] { write_import_session(request); }), HasSubstr("lies in the folder of the "))
        << out;
  }
  EXPECT_FALSE(fs::exists(folder.path() / "in/s"));
  EXPECT_FALSE(fs::exists(folder.path() / "dark/deep"));
  request.out = folder.path() / "in2";
  write_import_session(request);
}

TEST(ImportSession, RefusesBadInputAndLeavesNothingBehind) {
  const TemporaryFolder folder;
  put_image(folder, "in/a.png", 1);
  const auto error = [](const ImportRequest& request) {
    return message_of<InputError>([&] { write_import_session(request); });
  };
  ImportRequest request = request_in(folder);
  request.images = folder.path() / "none";
  EXPECT_THAT(error(request), HasSubstr("none: is not a folder, expected one with images"));
  request = request_in(folder);
  request.plane.reset();
  EXPECT_THAT(error(request), HasSubstr("found no laser plane, expected --plane or --planes"));
  request.planes = {{"b.png", {}}};
  EXPECT_THAT(error(request), HasSubstr("a.png: has no plane in the planes file"));
  request.planes = {{"a.png", {}}, {"b.png", {}}};
  EXPECT_THAT(error(request), HasSubstr("b.png: does not exist, expected every image named in the planes file"));
  request = request_in(folder);
  request.camera.width = 9;
  EXPECT_THAT(error(request), HasSubstr("a.png: found 8 x 6 px, expected 9 x 6 as in the camera file"));
  request = request_in(folder);
  request.plane = Plane{Vector3d(0.99989, 0.01415, 0.00503).normalized(), 16};
  EXPECT_THAT(error(request), HasSubstr("plane: found d = 16, a plane that is "));
  EXPECT_THAT(error(request), HasSubstr("looks like millimetres, expected metres"));
  request.plane.reset();
  request.planes = {{"a.png", {Vector3d::UnitZ(), 1}}};
  EXPECT_THAT(error(request), HasSubstr("planes, none in view: found d = 1, a plane that is nowhere in front"));
  folder.write("in/b.png", "\x89PNG\r\n\x1a\n" + std::string("\0\0\0\rIHDR\0\1\x86\xa0\0\1\x86\xa0", 16));
  EXPECT_THAT(error(request_in(folder)), HasSubstr("b.png: found 100000 x 100000 px, expected 8 x 6 as in the camera"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()), 1) << "only 'in' is left";
}

}  // namespace
}  // namespace tankrig
