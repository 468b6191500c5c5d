// Who may do what: one table, asked by the server for every request and every message.
#pragma once

#include <array>
#include <string>
#include <string_view>

#include "core/enum_names.hpp"

namespace tankrig {

enum class Role { kWatch, kOperate, kAdminister };
template <>
inline constexpr std::array kNames<Role>{"watch", "operate", "administer"};

struct Right {
  std::string_view act;  ///< "GET PATH", "upload", "say WISH" over the WebSocket, "run COMMAND"
  Role least;
};

/// What stands not here needs kAdminister. Whoever may do something may do all that a lesser role may.
inline constexpr std::array kRights{
    Right{"GET /", Role::kWatch},
    Right{"GET /console.css", Role::kWatch},
    Right{"GET /console.js", Role::kWatch},
    Right{"GET /live", Role::kWatch},
    Right{"GET /sessions", Role::kWatch},
    Right{"GET /benchmarks", Role::kWatch},
    Right{"GET /experiments", Role::kWatch},
    Right{"GET /downloads", Role::kWatch},
    Right{"GET /api/sessions", Role::kWatch},
    Right{"say stop", Role::kWatch},
    // The benchmark platform's.
    Right{"GET /platform.js", Role::kWatch},
    Right{"GET /api/platform", Role::kWatch},
    Right{"GET /api/datasets", Role::kWatch},
    Right{"GET /api/submissions", Role::kWatch},
    Right{"GET /submissions", Role::kWatch},
    Right{"GET /datasets", Role::kWatch},
    Right{"GET /files", Role::kWatch},
    Right{"upload", Role::kOperate},
    // What opens a device, and what moves or lights anything.
    Right{"GET /api/arm", Role::kOperate},
    Right{"GET /api/doctor", Role::kOperate},
    Right{"GET /api/plan", Role::kOperate},
    Right{"GET /api/path", Role::kOperate},
    Right{"say take", Role::kOperate},
    Right{"say offer", Role::kOperate},
    Right{"say release", Role::kOperate},
    Right{"say rig", Role::kOperate},
    Right{"say start", Role::kOperate},
    Right{"say answer", Role::kOperate},
    Right{"say hold", Role::kOperate},
    Right{"run scan", Role::kOperate},
    Right{"run preview", Role::kOperate},
    Right{"run lit", Role::kOperate},
    Right{"run jog", Role::kOperate},
    Right{"run park", Role::kOperate},
    Right{"run home", Role::kOperate},
    Right{"run make_safe", Role::kOperate},
    Right{"run experiment", Role::kOperate},
    Right{"run bench", Role::kOperate},
    Right{"run check", Role::kOperate},
    // What changes the machine's calibration or a session that is there.
    Right{"say corners", Role::kAdminister},
    Right{"run calibrate", Role::kAdminister},
    Right{"run report", Role::kAdminister},
    Right{"run recover", Role::kAdminister},
};

constexpr Role least_role(std::string_view act) {
  for (const Right& right : kRights)
    if (right.act == act) return right.least;
  return Role::kAdminister;
}

constexpr bool may(Role role, std::string_view act) { return role >= least_role(act); }

/// The act of asking for a decoded path: "GET /sessions" of all files of sessions.
inline std::string get_act(std::string_view path) {
  for (const std::string_view folder : {"/sessions", "/benchmarks", "/experiments", "/downloads", "/submissions",
                                        "/datasets", "/files", "/api/datasets", "/api/submissions", "/api/path"})
    if (path.starts_with(folder) && path.substr(folder.size()).starts_with('/')) path = folder;
  return "GET " + std::string(path);
}

}  // namespace tankrig
