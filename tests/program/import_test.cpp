// Another scanner's photographs: generated with known truth, imported, reconstructed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <random>

#include "core/camera_model.hpp"
#include "reconstruction/cloud/cloud_io.hpp"
#include "tests/program/program.hpp"

namespace fs = std::filesystem;

namespace tankrig::test {
namespace {

using testing::HasSubstr;

/// A scanner that is not ours: its camera, its sheet, the colour of its line, and a board it looks at.
struct Scanner {
  CameraModel camera{640, 480, 514.4, 685.9, 329.8, 237.7, -0.35, 0.158, 0.0007, -0.0002, 0};
  Plane sheet;       ///< in c
  cv::Vec3d colour;  ///< BGR of the line's peak, beyond 255 where it clips
  double room = 60;  ///< grey level of the board without laser
  double sigma_px = 1.6;
};

/// Board of image `n`, in c: 0.6 to 0.8 m away, tilted.
Plane board(int n) {
  const Vector3d normal = Vector3d(0.25 * (n - 1), 0.2, -1).normalized();
  return {normal, -normal.dot(Vector3d(0, 0, 0.6 + 0.1 * n))};
}

/// The line's profile at every pixel, from the pixel's distance to the projected line, measured across the rows or
/// columns.
cv::Mat photograph(const Scanner& s, const Plane& target, bool along_columns, std::mt19937& rng) {
  std::normal_distribution<double> noise(0, 2);
  cv::Mat image(s.camera.height, s.camera.width, CV_8UC3);
  const int lines = along_columns ? s.camera.height : s.camera.width,
            length = along_columns ? s.camera.width : s.camera.height;
  for (int line = 0; line < lines; ++line) {
    // Zero of the sheet's distance along this row or column, on the board, by bisection.
    const auto distance = [&](double at) {
      const Vector3d ray = along_columns ? s.camera.ray(at, line) : s.camera.ray(line, at);
      return s.sheet.distance(ray * (-target.offset / target.normal.dot(ray)));
    };
    double low = 0, high = length - 1;
    const bool crossed = (distance(low) > 0) != (distance(high) > 0);
    for (int i = 0; crossed && i < 40; ++i) {
      const double middle = 0.5 * (low + high);
      ((distance(low) > 0) == (distance(middle) > 0) ? low : high) = middle;
    }
    for (int at = 0; at < length; ++at) {
      const double profile = crossed ? std::exp(-0.5 * std::pow((at - low) / s.sigma_px, 2)) : 0;
      cv::Vec3b& pixel = along_columns ? image.at<cv::Vec3b>(line, at) : image.at<cv::Vec3b>(at, line);
      for (int c = 0; c < 3; ++c) pixel[c] = cv::saturate_cast<uchar>(s.room + s.colour[c] * profile + noise(rng));
    }
  }
  return image;
}

void write_camera(const fs::path& file, const CameraModel& c) {
  std::ofstream(file) << "image_width: " << c.width << "\nimage_height: " << c.height
                      << "\ncamera_name: other\ncamera_matrix: {rows: 3, cols: 3, data: [" << c.fx << ", 0, " << c.cx
                      << ", 0, " << c.fy << ", " << c.cy << ", 0, 0, 1]}\ndistortion_model: plumb_bob\n"
                      << "distortion_coefficients: {rows: 1, cols: 5, data: [" << c.k1 << ", " << c.k2 << ", " << c.p1
                      << ", " << c.p2 << ", " << c.k3 << "]}\n";
}

/// Imports three photographs and reconstructs them; rms distance of the points to their boards [m], and how many there
/// are.
std::pair<double, std::size_t> reconstructed(const Scanner& scanner, bool along_columns, bool plane_per_image) {
  const fs::path folder = scratch_folder();
  fs::create_directories(folder / "my photos");
  constexpr unsigned kSeed = 5;
  testing::Test::RecordProperty("seed", static_cast<int>(kSeed));
  std::mt19937 rng(kSeed);
  const Plane& p = scanner.sheet;
  std::ostringstream plane;
  plane.precision(12);
  plane << p.normal.x() << "," << p.normal.y() << "," << p.normal.z() << "," << p.offset;
  std::ofstream planes(folder / "planes.csv");
  planes << "file,a,b,c,d\n";
  for (int n = 0; n < 3; ++n) {
    const std::string name = "shot " + std::to_string(n) + ".png";
    cv::imwrite((folder / "my photos" / name).string(), photograph(scanner, board(n), along_columns, rng));
    planes << name << "," << plane.str() << "\n";
  }
  planes.close();
  write_camera(folder / "camera.yaml", scanner.camera);
  const std::string session = (folder / "session").string();
  std::vector<std::string> arguments{
      "session", "import", "--images", (folder / "my photos").string(), "--camera", (folder / "camera.yaml").string(),
      "--out",   session};
  if (plane_per_image)
    arguments.insert(arguments.end(), {"--planes", (folder / "planes.csv").string()});
  else
    arguments.insert(arguments.end(), {"--plane", plane.str()});
  const ProgramRun import = run_tankrig(arguments);
  EXPECT_EQ(import.exit_code, 0) << import.err;
  const ProgramRun run = run_tankrig({"reconstruct", session, "--method", "laser", "--json"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_TRUE(fs::exists(fs::path(session) / "clouds/stripe.csv"));
  const PointCloud cloud = read_cloud(run.json().at("cloud").get<std::string>());
  double squares = 0;
  for (const CloudPoint& point : cloud.points) squares += std::pow(board(point.frame).distance(point.p), 2);
  return {std::sqrt(squares / std::max<std::size_t>(1, cloud.points.size())), cloud.points.size()};
}

TEST(Import, ARedLineAlongTheColumnsWithOnePlaneForAll) {
  Scanner scanner;
  scanner.sheet = {Vector3d(0.94, 0.02, 0.341).normalized(), -0.22};
  scanner.colour = {20, 30, 180};
  const auto [rms, points] = reconstructed(scanner, true, false);
  EXPECT_LT(rms, 0.5e-3);
  EXPECT_GT(points, 3u * 480 * 9 / 10);
}

TEST(Import, AClippedGreenLineAlongTheRowsInABrightRoomWithAPlanePerImage) {
  Scanner scanner;
  scanner.sheet = {Vector3d(0.03, 0.94, 0.341).normalized(), -0.22};
  scanner.colour = {150, 900, 120};
  scanner.room = 140;
  const auto [rms, points] = reconstructed(scanner, false, true);
  EXPECT_LT(rms, 0.5e-3);
  EXPECT_GT(points, 3u * 640 * 9 / 10);
}

TEST(Import, APaperGateThatDoesNotSuitTheLaserIsNamedInOneWarning) {
  Scanner scanner;
  scanner.sheet = {Vector3d(0.94, 0.02, 0.341).normalized(), -0.22};
  scanner.colour = {20, 30, 180};  // red: no hue of the laboratory's gate
  reconstructed(scanner, true, false);
  const std::string session = (scratch_folder() / "session").string();
  const ProgramRun run = run_tankrig({"reconstruct", session, "--method", "laser_paper", "--json"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const std::string gate = "its gate (hue 15 to 91, saturation 0 to 90, value 181 to 255) found a stripe in ";
  EXPECT_THAT(run.err, HasSubstr(gate));
  EXPECT_EQ(run.err.find(gate), run.err.rfind(gate)) << "once";
  EXPECT_THAT(run.err, testing::ContainsRegex("in [0-9]\\.[0-9] % of the columns, expected at least 10 %"));
  EXPECT_THAT(run.json().at("warning").get<std::string>(), HasSubstr(gate));
  EXPECT_THAT(run_tankrig({"reconstruct", session, "--method", "laser"}).err, testing::Not(HasSubstr("its gate")));
}

/// A folder with a camera file and three pictures, the second of them cut; arguments of an import of it.
struct CutImport {
  fs::path folder = scratch_folder();
  std::vector<std::string> arguments{"session",  "import",
                                     "--images", (folder / "photos").string(),
                                     "--camera", (folder / "camera.yaml").string(),
                                     "--out",    (folder / "session").string(),
                                     "--plane"};

  CutImport() {
    fs::create_directories(folder / "photos");
    const Scanner scanner;
    write_camera(folder / "camera.yaml", scanner.camera);
    cv::Mat noise(scanner.camera.height, scanner.camera.width, CV_8UC3);
    cv::randu(noise, 0, 255);
    for (const char* name : {"a.jpg", "b.jpg", "c.jpg"}) cv::imwrite((folder / "photos" / name).string(), noise);
    fs::resize_file(folder / "photos/b.jpg", fs::file_size(folder / "photos/b.jpg") / 2);
  }
  ProgramRun run(const std::string& plane, const std::vector<std::string>& more = {}) {
    std::vector<std::string> all = arguments;
    all.push_back(plane);
    all.insert(all.end(), more.begin(), more.end());
    return run_tankrig(all);
  }
};

TEST(Import, ACutPictureIsNamedCountedAndLeftOut) {
  const ProgramRun run = CutImport().run("0.94,0.02,0.341,-0.22");
  EXPECT_EQ(run.exit_code, 3) << run.err;
  EXPECT_THAT(run.err, HasSubstr("photos/b.jpg: is a JPEG that is cut short, expected a whole one"));
  EXPECT_THAT(run.err, HasSubstr("images left out: 1"));
  EXPECT_THAT(run.out, testing::ContainsRegex("mono.left_out +1\n"));
  fs::remove_all(CutImport().folder / "session");
  const ProgramRun json = CutImport().run("0.94,0.02,0.341,-0.22", {"--json"});
  EXPECT_EQ(json.exit_code, 3) << json.err;
  EXPECT_EQ(json.json().at("left_out").size(), 1u);
}

TEST(Import, APlaneInMillimetresIsRefusedInOneLine) {
  for (const char* plane : {"0.94,0.02,0.341,-220", "0.99989,0.01415,0.00503,16"}) {
    CutImport import;
    const ProgramRun run = import.run(plane);
    EXPECT_EQ(run.exit_code, 1) << plane;
    EXPECT_THAT(run.err, HasSubstr("looks like millimetres, expected metres")) << plane;
    EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
    EXPECT_FALSE(fs::exists(import.folder / "session"));
  }
}

TEST(Reconstruct, APlaneInMillimetresThatASessionHasIsRefused) {
  CutImport import;
  ASSERT_EQ(import.run("1,0,0,0.016").exit_code, 3);
  std::ifstream in(import.folder / "session/frames.csv");
  std::string frames{std::istreambuf_iterator<char>(in), {}};
  for (std::size_t at = 0; (at = frames.find(",1,0,0,0.016,", at)) != std::string::npos; ++at)
    frames.replace(at, 13, ",1,0,0,16,");
  std::ofstream(import.folder / "session/frames.csv") << frames;
  const ProgramRun run = run_tankrig({"reconstruct", (import.folder / "session").string()});
  EXPECT_EQ(run.exit_code, 1) << frames;
  EXPECT_THAT(run.err, HasSubstr("frames.csv: found d = 16, a plane that is "));
  EXPECT_THAT(run.err, HasSubstr("looks like millimetres, expected metres"));
}

}  // namespace
}  // namespace tankrig::test
