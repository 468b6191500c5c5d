#include "console/server/session_files.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "core/input_error.hpp"
#include "core/regular_file.hpp"
#include "session/reading/session_folder.hpp"

namespace fs = std::filesystem;

namespace tankrig {
namespace {

/// A report draws its own figures and loads nothing; it is a stranger to the console, without its cookie.
constexpr char kReportPolicy[] =
    "sandbox allow-scripts; default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:; "
    "frame-ancestors 'self'";

struct Kind {
  const char *extension, *type;
  bool shown;
};
constexpr std::array kKinds{Kind{".html", "text/html; charset=utf-8", true},
                            Kind{".png", "image/png", true},
                            Kind{".jpg", "image/jpeg", true},
                            Kind{".csv", "text/plain; charset=utf-8", true},
                            Kind{".yaml", "text/plain; charset=utf-8", true},
                            Kind{".json", "application/json", true},
                            Kind{".log", "text/plain; charset=utf-8", true},
                            Kind{".ply", "application/octet-stream", false}};

bool leads_below(const fs::path& path) {
  return !path.empty() && path.is_relative() &&
         std::ranges::none_of(path, [](const fs::path& part) { return part == ".." || part == "."; });
}

}  // namespace

std::string plain_name(const fs::path& file) {
  std::string name = file.filename().string();
  std::ranges::replace_if(
      name, [](unsigned char c) { return c < 0x20 || c >= 0x7f || c == '"' || c == '\\'; }, '_');
  return name;
}

WebReply session_file(const fs::path& sessions, const std::string& path) {
  const fs::path below(path);
  if (!leads_below(below) || below.begin() == --below.end()) return {.status = 404, .body = "No such file.\n"};
  try {
    const fs::path session = sessions / *below.begin();
    if (fs::is_symlink(session)) throw InputError(session, "found a link, expected a session");
    refuse_links(session);
    const fs::path file = sessions / below;
    WebReply reply;
    reply.file = open_regular_file(file, std::numeric_limits<std::int64_t>::max(), "a file of a session");
    const auto kind =
        std::ranges::find(kKinds, file.extension().string(), [](const Kind& k) { return std::string(k.extension); });
    const bool known = kind != kKinds.end();
    reply.type = known ? kind->type : "application/octet-stream";
    if (!known || !kind->shown) reply.download_as = plain_name(file);
    reply.policy = kReportPolicy;
    return reply;
  } catch (const std::exception&) {
    return {.status = 404, .body = "No such file.\n"};
  }
}

}  // namespace tankrig
