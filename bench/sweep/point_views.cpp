#include "bench/sweep/point_views.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>

#include "core/atomic_file.hpp"
#include "core/input_error.hpp"
#include "core/regular_file.hpp"

namespace fs = std::filesystem;
using nlohmann::ordered_json;

namespace tankrig {
namespace {

const char* const kViews = "views.jsonl";

constexpr const char* kBase64 = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/=";

}  // namespace

void add_views(const fs::path& folder, std::size_t point, const std::vector<PointView>& views) {
  ordered_json line{{"point", point}, {"views", ordered_json::array()}};
  for (const PointView& view : views)
    line["views"].push_back({{"caption", view.caption}, {"measure", view.measure}, {"jpeg", view.jpeg}});
  const fs::path file = folder / kViews;
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
  if (descriptor < 0) throw CannotWrite(file, errno);
  const auto close = std::unique_ptr<const int, void (*)(const int*)>(&descriptor, [](const int* d) { ::close(*d); });
  const std::string text = "\n" + line.dump() + "\n";  // the first line end ends a line that was cut
  std::string_view left = text;
  write_all(file, descriptor, left);
}

PointViews read_views(const fs::path& folder) {
  PointViews out;
  const fs::path file = folder / kViews;
  if (!fs::exists(file)) return out;
  std::istringstream lines(read_regular_file(file, kMostPictureBytes, "what tankrig bench writes"));
  int number = 0;
  for (std::string text; std::getline(lines, text);) {
    ++number;
    const ordered_json line = ordered_json::parse(text, nullptr, false);
    if (!line.is_object()) continue;
    try {
      std::vector<PointView> views;
      for (const ordered_json& view : line.at("views"))
        views.push_back({view.at("caption"), view.at("measure"), view.at("jpeg")});
      for (const PointView& view : views)
        if (view.jpeg.find_first_not_of(kBase64) != std::string::npos)
          throw InputError(file, number, "jpeg: found no base64");
      out[line.at("point").get<std::size_t>()] = std::move(views);
    } catch (const ordered_json::exception&) {
      throw InputError(file, number, "found no configuration's pictures, expected what tankrig bench writes");
    }
  }
  return out;
}

}  // namespace tankrig
