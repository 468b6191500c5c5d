#include "session/import/session_import.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <opencv2/imgcodecs.hpp>
#include <set>
#include <vector>

#include "core/input_error.hpp"
#include "core/laser_view.hpp"
#include "core/regular_file.hpp"
#include "core/text_files.hpp"
#include "core/utc.hpp"
#include "session/checking/checksums.hpp"
#include "session/reading/picture_file.hpp"
#include "session/reading/session_tables.hpp"
#include "session/reading/session_yaml.hpp"
#include "session/recording/event_kinds.hpp"
#include "session/recording/session_writer.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;

constexpr const char* kCamera = "mono";

/// Type of the image's pixels, as OpenCV counts them.
int check_image(const fs::path& file, const CameraModel& camera) {
  const ExpectedSize expected{camera.width, camera.height, "as in the camera file"};
  return decode_picture(read_regular_file(file, kMostPictureBytes, "an image"), file, &expected,
                        cv::IMREAD_ANYCOLOR | cv::IMREAD_ANYDEPTH | cv::IMREAD_IGNORE_ORIENTATION)
      .type();
}

std::string pixels_in_words(int type) {
  const std::size_t bits = 8 * CV_ELEM_SIZE1(type);
  return fmt::format("{} x {} bits{}", CV_MAT_CN(type), bits, CV_MAT_DEPTH(type) >= CV_32F ? " (floating point)" : "");
}

/// The images that can be decoded; the others go to `left_out`.
struct Images {
  std::vector<fs::path> files;
  std::vector<int> types;  ///< of their pixels
};

Images whole_images(const std::vector<fs::path>& files, const CameraModel& camera, std::vector<std::string>& left_out) {
  Images whole;
  for (const fs::path& file : files) {
    try {
      whole.types.push_back(check_image(file, camera));
      whole.files.push_back(file);
    } catch (const DamagedPicture& e) {
      left_out.push_back(e.what());
    }
  }
  return whole;
}

/// Dark images are subtracted from the others: their pixels must be alike.
void check_dark_images(const Images& dark, const Images& images) {
  for (std::size_t i = 0; i < dark.files.size(); ++i)
    if (dark.types[i] != images.types.front())
      throw InputError(dark.files[i], "found " + pixels_in_words(dark.types[i]) + " a pixel, expected " +
                                          pixels_in_words(images.types.front()) + " as in " +
                                          images.files.front().filename().string());
}

void check_out_is_outside(const fs::path& out, const fs::path& folder, const char* what) {
  if (lies_within(out, folder))
    throw InputError(out, std::string("lies in the folder of the ") + what + " " + folder.string() +
                              ", expected a place outside of it");
}

void check_planes(const ImportRequest& request, const std::vector<fs::path>& images) {
  if (request.plane.has_value() == !request.planes.empty())
    throw InputError("found " + std::string(request.plane ? "both a plane and planes per image" : "no laser plane") +
                     ", expected --plane or --planes");
  if (request.plane) return;
  std::set<std::string> names;
  for (const fs::path& image : images) {
    names.insert(image.filename().string());
    if (!request.planes.contains(image.filename().string()))
      throw InputError(image, "has no plane in the planes file, expected one for every image");
  }
  for (const auto& [name, plane] : request.planes)
    if (!names.contains(name))
      throw InputError(request.images / name, "does not exist, expected every image named in the planes file");
}

void check_in_view(const ImportRequest& request) {
  std::vector<Plane> planes;
  if (request.plane) planes.push_back(*request.plane);
  for (const auto& [name, plane] : request.planes) planes.push_back(plane);
  if (const std::string wrong = out_of_view(request.camera, planes); !wrong.empty())
    throw InputError((request.plane ? "plane: " : "planes, none in view: ") + wrong);
}

std::string copy_images(const ImportRequest& request, const std::vector<fs::path>& images, bool dark, int first,
                        const fs::path& session) {
  const fs::path folder = fs::path("frames") / kCamera / (dark ? "dark" : "");
  if (!images.empty()) fs::create_directories(session / folder);
  std::string lines;
  for (std::size_t i = 0; i < images.size(); ++i) {
    const std::string name = images[i].filename().string();
    FrameRecord frame;
    frame.camera = kCamera;
    frame.index = first + static_cast<int>(i);
    frame.sequence = static_cast<std::uint64_t>(frame.index);
    frame.phase = dark ? Phase::kDarkBefore : Phase::kSweep;
    frame.laser_on = !dark;
    frame.file = (folder / name).generic_string();
    if (!dark) frame.cPl = request.plane ? *request.plane : request.planes.at(name);
    copy_whole_file(images[i], session / frame.file);
    lines += frames_line(frame);
  }
  return lines;
}

}  // namespace

std::vector<fs::path> images_in(const fs::path& folder) {
  static const std::set<std::string> kEndings{".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pgm", ".ppm"};
  std::error_code failed;
  if (!fs::is_directory(folder, failed)) throw InputError(folder, "is not a folder, expected one with images");
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    std::string ending = entry.path().extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
    if (entry.is_regular_file() && kEndings.contains(ending)) files.push_back(entry.path());
  }
  if (files.empty()) throw InputError(folder, "holds no image, expected .png, .jpg, .bmp, .tif, .pgm or .ppm files");
  std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
    return natural_less(a.filename().string(), b.filename().string());
  });
  return files;
}

bool natural_less(std::string_view a, std::string_view b) {
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (digit(a[i]) && digit(b[j])) {
      std::size_t i_end = i, j_end = j;
      while (i_end < a.size() && digit(a[i_end])) ++i_end;
      while (j_end < b.size() && digit(b[j_end])) ++j_end;
      while (i < i_end && a[i] == '0') ++i;
      while (j < j_end && b[j] == '0') ++j;
      if (i_end - i != j_end - j) return i_end - i < j_end - j;
      for (; i < i_end; ++i, ++j)
        if (a[i] != b[j]) return a[i] < b[j];
    } else {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i, ++j;
    }
  }
  const bool a_ends = i == a.size(), b_ends = j == b.size();
  return a_ends != b_ends ? a_ends : a < b;
}

std::vector<std::string> write_import_session(const ImportRequest& request) {
  const std::vector<fs::path> images = images_in(request.images);
  const std::vector<fs::path> dark = request.dark ? images_in(*request.dark) : std::vector<fs::path>{};
  check_planes(request, images);
  check_in_view(request);
  if (fs::exists(request.out)) throw InputError(request.out, "exists already, expected the name of a new session");
  check_out_is_outside(request.out, request.images, "images");
  if (request.dark) check_out_is_outside(request.out, *request.dark, "dark images");
  std::vector<std::string> left_out;
  const Images whole = whole_images(images, request.camera, left_out);
  if (whole.files.empty())
    throw InputError(request.images, fmt::format("holds no image that is whole, expected one; of {} the first: {}",
                                                 images.size(), left_out.front()));
  const Images whole_dark = whole_images(dark, request.camera, left_out);
  check_dark_images(whole_dark, whole);

  UnfinishedFolder made(request.out);
  const fs::path& session = made.path();
  FileSystemSync disk(session);
  SessionInfo info;
  info.name = made.target().filename().string();
  info.status = "complete";
  info.kind = "import";
  info.created_utc = utc_now();
  info.operator_name = request.operator_name;
  info.notes = request.notes;
  info.software = request.software;
  info.noise = "device";
  info.cameras = {{kCamera, CameraRole::kMono, request.camera, Transform::Identity()}};
  std::string frames = frames_header();
  frames += copy_images(request, whole.files, false, 0, session);
  frames += copy_images(request, whole_dark.files, true, static_cast<int>(whole.files.size()), session);
  info.counts[std::string(kCamera) + ".recorded"] = whole.files.size() + whole_dark.files.size();
  if (!left_out.empty()) info.counts[std::string(kCamera) + ".left_out"] = left_out.size();
  std::string events = events_header();
  for (const std::string& image : left_out) events += events_line({}, event_kind::kLeftOut, image);
  write_whole_file(session / "frames.csv", frames);
  write_whole_file(session / "joints.csv", joints_header());
  write_whole_file(session / "events.csv", events);
  write_whole_file(session / "session.yaml", session_yaml(info));
  disk.sync();
  write_checksums(session);
  made.put_in_place();
  return left_out;
}

}  // namespace tankrig
