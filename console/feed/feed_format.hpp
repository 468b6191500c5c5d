// The messages in which a running command tells another program what happens. docs/reference/console.md describes them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace tankrig {

/// Names the descriptor of a SOCK_SEQPACKET socket on which somebody listens.
inline constexpr char kFeedVariable[] = "TANKRIG_FEED";

/// The first byte of a message.
enum class FeedKind : char {
  kText = 'T',    ///< a JSON object follows, its "feed" says which
  kPoints = 'L',  ///< their frame's stamp, int64 [ns], and float32 x, y, z of each, in b [m], follow, little-endian
  kPicture = 'P'  ///< a byte with the length of the camera's name, the name, and a JPEG follow
};

/// Before the first point of such a message: the kind, and the stamp.
inline constexpr std::size_t kPointsBegin = 1 + sizeof(std::int64_t);

/// Begins, instead of a camera's name alone, the name of its newest picture that a calibration judged, with what was found
/// marked in it.
inline constexpr char kJudgedPicture[] = "judged: ";

/// Of a whole message: what a socket's ordinary buffer takes at once.
inline constexpr std::size_t kMostFeedBytes = 160'000;

/// Whose picture a message is; nothing if it is none.
inline std::optional<std::string_view> pictured_camera(std::string_view message) {
  if (message.size() < 2 || message[0] != static_cast<char>(FeedKind::kPicture)) return std::nullopt;
  const auto length = static_cast<unsigned char>(message[1]);
  if (message.size() < 2U + length) return std::nullopt;
  return message.substr(2, length);
}

}  // namespace tankrig
