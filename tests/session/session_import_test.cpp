// Sessions out of other people's photographs.
#include "rig/session/session_import.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "core/input_error.hpp"
#include "rig/session/checksums.hpp"
#include "rig/session/session.hpp"
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

TEST(ParsePlane, ScalesToAUnitNormal) {
  const Plane plane = parse_plane(" 0, 3,-4 , 2.5");
  EXPECT_TRUE(plane.normal.isApprox(Vector3d(0, 0.6, -0.8), 1e-15));
  EXPECT_DOUBLE_EQ(plane.offset, 0.5);
}

TEST(ParsePlane, OnlyALasersPlaneMustNotPassThroughTheOrigin) {
  EXPECT_EQ(parse_plane("0,0,1,0").offset, 0);
  EXPECT_THROW(parse_laser_plane("0,0,1,0"), InputError);
}

TEST(ParsePlane, SaysWhatIsWrong) {
  const auto error = [](const char* text) { return message_of<InputError>([&] { parse_laser_plane(text); }); };
  EXPECT_THAT(error("1,2,3"), HasSubstr("plane '1,2,3': found 3 numbers, expected a,b,c,d"));
  EXPECT_THAT(error("1,2,x,4"), HasSubstr("found 'x', expected a number"));
  EXPECT_THAT(error("1,2,,4"), HasSubstr("found '', expected a number"));
  EXPECT_THAT(error("0,0,0,4"), HasSubstr("normal a,b,c of length 0"));
  EXPECT_THAT(error("1,0,0,0"), HasSubstr("through the camera's centre"));
  EXPECT_THAT(error("inf,0,0,1"), HasSubstr("found 'inf'"));
}

TEST(PlanesCsv, ReadsOnePlaneAFileWithOrWithoutHeader) {
  const TemporaryFolder folder;
  for (const char* header : {"", "file,a,b,c,d\n"}) {
    const auto planes =
        read_planes_csv(folder.write("p.csv", std::string(header) + "a.png,1,0,0,-0.5\n\"b,c.png\", 0,0,2,1\n"));
    ASSERT_EQ(planes.size(), 2u);
    EXPECT_EQ(planes.at("a.png").offset, -0.5);
    EXPECT_EQ(planes.at("b,c.png").offset, 0.5);
  }
}

TEST(PlanesCsv, NamesFileAndLineOfBadInput) {
  const TemporaryFolder folder;
  const auto error = [&](const std::string& text) {
    return message_of<InputError>([&] { read_planes_csv(folder.write("p.csv", text)); });
  };
  EXPECT_THAT(error("file,a,b,c,d\na.png,1,0,0\n"), HasSubstr("p.csv:2: found 4 fields, expected 5: file,a,b,c,d"));
  EXPECT_THAT(error("a.png,1,0,0,1\na.png,1,0,0,1\n"), HasSubstr("p.csv:2: found 'a.png' for the second time"));
  EXPECT_THAT(error(""), HasSubstr("p.csv: holds no plane"));
  EXPECT_THAT(message_of<InputError>([&] { read_planes_csv(folder.path() / "no.csv"); }),
              HasSubstr("no.csv: cannot be read"));
}

TEST(PlanesCsv, TakesTheColumnsInTheOrderOfItsHeader) {
  const TemporaryFolder folder;
  const auto planes = read_planes_csv(folder.write("p.csv", "d, c,b,a,file\r\n-0.5,0,0,1,a.png\r\n"));
  ASSERT_EQ(planes.size(), 1u);
  EXPECT_EQ(planes.at("a.png").normal, Vector3d::UnitX());
  EXPECT_EQ(planes.at("a.png").offset, -0.5);
}

TEST(PlanesCsv, SkipsAByteOrderMark) {
  const TemporaryFolder folder;
  for (const char* header : {"", "file,a,b,c,d\n"})
    EXPECT_EQ(read_planes_csv(folder.write("p.csv", std::string("\xef\xbb\xbf") + header + "a.png,1,0,0,-0.5\n"))
                  .count("a.png"),
              1u);
}

TEST(PlanesCsv, RefusesAHeaderWithOtherColumns) {
  const TemporaryFolder folder;
  const auto error = [&](const std::string& header) {
    return message_of<InputError>([&] { read_planes_csv(folder.write("p.csv", header + "\na.png,1,0,0,-0.5\n")); });
  };
  EXPECT_THAT(error("name,a,b,c,d"),
              HasSubstr("p.csv:1: column 1: found 'name', expected exactly the columns file,a,b,c,d"));
  EXPECT_THAT(error("file,a,b,c,d,e"), HasSubstr("p.csv:1: column 6: found 'e'"));
  EXPECT_THAT(error("file,a,b,b,d"), HasSubstr("p.csv:1: column 4: found 'b' for the second time"));
  EXPECT_THAT(error("file,a,b,d"), HasSubstr("p.csv:1: found no column 'c'"));
  EXPECT_THAT(error("file,1,2,3,4"), HasSubstr("p.csv:1: column 2: found '1'"));
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
  EXPECT_TRUE(check_checksums(request.out).empty());
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
  folder.write("in/b.png", "not a picture");
  EXPECT_THAT(error(request_in(folder)), HasSubstr("b.png: cannot be decoded, expected an image"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()), 1) << "only 'in' is left";
}

}  // namespace
}  // namespace tankrig
