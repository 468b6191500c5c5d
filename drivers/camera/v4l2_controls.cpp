#include "drivers/camera/v4l2_controls.hpp"

#include <fmt/format.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cstring>
#include <string_view>

#include "core/input_error.hpp"

namespace tankrig {
namespace {

struct RenamedControl {
  std::string_view name;
  std::uint32_t id;
};

/// Names before and since kernel 5.17 ("media: v4l2-ctrls: Document ... rename"), so that a rig file serves both.
constexpr std::array kBothNames{
    RenamedControl{"exposure_auto", V4L2_CID_EXPOSURE_AUTO},
    RenamedControl{"auto_exposure", V4L2_CID_EXPOSURE_AUTO},
    RenamedControl{"exposure_absolute", V4L2_CID_EXPOSURE_ABSOLUTE},
    RenamedControl{"exposure_time_absolute", V4L2_CID_EXPOSURE_ABSOLUTE},
    RenamedControl{"exposure_auto_priority", V4L2_CID_EXPOSURE_AUTO_PRIORITY},
    RenamedControl{"exposure_dynamic_framerate", V4L2_CID_EXPOSURE_AUTO_PRIORITY},
    RenamedControl{"white_balance_temperature_auto", V4L2_CID_AUTO_WHITE_BALANCE},
    RenamedControl{"white_balance_automatic", V4L2_CID_AUTO_WHITE_BALANCE},
    RenamedControl{"white_balance_auto", V4L2_CID_AUTO_WHITE_BALANCE},
    RenamedControl{"focus_auto", V4L2_CID_FOCUS_AUTO},
    RenamedControl{"focus_automatic_continuous", V4L2_CID_FOCUS_AUTO},
    RenamedControl{"hue_auto", V4L2_CID_HUE_AUTO},
    RenamedControl{"hue_automatic", V4L2_CID_HUE_AUTO},
    RenamedControl{"autogain", V4L2_CID_AUTOGAIN},
    RenamedControl{"gain_automatic", V4L2_CID_AUTOGAIN},
};

struct Manual {
  std::uint32_t id;
  std::int32_t value;
};

constexpr std::array kManual{
    Manual{V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL},
    Manual{V4L2_CID_EXPOSURE_AUTO_PRIORITY, 0},
    Manual{V4L2_CID_AUTOGAIN, 0},
    Manual{V4L2_CID_AUTO_WHITE_BALANCE, 0},
    Manual{V4L2_CID_AUTO_N_PRESET_WHITE_BALANCE, V4L2_WHITE_BALANCE_MANUAL},
    Manual{V4L2_CID_ISO_SENSITIVITY_AUTO, V4L2_ISO_SENSITIVITY_MANUAL},
    Manual{V4L2_CID_FOCUS_AUTO, 0},
    Manual{V4L2_CID_HUE_AUTO, 0},
    Manual{V4L2_CID_AUTOBRIGHTNESS, 0},
    Manual{V4L2_CID_CHROMA_AGC, 0},
    Manual{V4L2_CID_WIDE_DYNAMIC_RANGE, 0},
    Manual{V4L2_CID_IMAGE_STABILIZATION, 0},
};

/// "White Balance, Automatic" -> white_balance_automatic
std::string variable_name(const char* text, std::size_t size) {
  std::string name;
  for (std::size_t i = 0; i < size && text[i] != '\0'; ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    if (std::isalnum(c))
      name += static_cast<char>(std::tolower(c));
    else if (!name.empty() && name.back() != '_')
      name += '_';
  }
  if (!name.empty() && name.back() == '_') name.pop_back();
  return name;
}

bool settable(std::uint32_t type) {
  switch (type) {
    case V4L2_CTRL_TYPE_INTEGER:
    case V4L2_CTRL_TYPE_BOOLEAN:
    case V4L2_CTRL_TYPE_MENU:
    case V4L2_CTRL_TYPE_INTEGER_MENU:
    case V4L2_CTRL_TYPE_BUTTON:
    case V4L2_CTRL_TYPE_BITMASK:
      return true;
    default:
      return false;
  }
}

std::optional<std::uint32_t> as_id(std::string_view text) {
  const int base = text.starts_with("0x") ? 16 : 10;
  if (base == 16) text.remove_prefix(2);
  std::uint32_t id = 0;
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), id, base);
  if (problem != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return id;
}

}  // namespace

V4l2Controls::V4l2Controls(V4l2Device& device) : device_(device) {
  v4l2_queryctrl query{};
  query.id = V4L2_CTRL_FLAG_NEXT_CTRL;
  while (device_.call(VIDIOC_QUERYCTRL, &query) == 0) {
    if (settable(query.type) && !(query.flags & V4L2_CTRL_FLAG_DISABLED))
      all_.push_back({query.id, variable_name(reinterpret_cast<const char*>(query.name), sizeof query.name), query.type,
                      query.flags, query.minimum, query.maximum});
    const std::uint32_t next = query.id | V4L2_CTRL_FLAG_NEXT_CTRL;
    query = {};
    query.id = next;
  }
}

const V4l2ControlInfo* V4l2Controls::find(const std::string& name_or_id) const {
  const std::optional<std::uint32_t> id = as_id(name_or_id);
  for (const V4l2ControlInfo& control : all_)
    if (control.name == name_or_id || control.id == id) return &control;
  for (const RenamedControl& alias : kBothNames)
    if (alias.name == name_or_id)
      for (const V4l2ControlInfo& control : all_)
        if (control.id == alias.id) return &control;
  return nullptr;
}

std::optional<std::int32_t> V4l2Controls::get(std::uint32_t id) const {
  v4l2_control control{id, 0};
  if (device_.call(VIDIOC_G_CTRL, &control) != 0) return std::nullopt;
  return control.value;
}

std::int32_t V4l2Controls::set(const std::string& name_or_id, std::int32_t value) {
  const V4l2ControlInfo* info = find(name_or_id);
  if (!info) {
    std::string known;
    for (const V4l2ControlInfo& control : all_) known += (known.empty() ? "" : ", ") + control.name;
    throw InputError("controls: found '" + name_or_id + "', expected one of: " + (known.empty() ? "none" : known));
  }
  const bool ranged = info->type != V4L2_CTRL_TYPE_BUTTON && info->type != V4L2_CTRL_TYPE_BITMASK;
  const std::string range = fmt::format("{}..{}", info->minimum, info->maximum);
  if (ranged && (value < info->minimum || value > info->maximum))
    throw InputError(fmt::format("controls: {}: found {}, expected {}", info->name, value, range));
  v4l2_control control{info->id, value};
  if (const int problem = device_.call(VIDIOC_S_CTRL, &control); problem != 0)
    throw InputError(fmt::format("controls: {}: the device refuses {} ({}; range {}{})", info->name, value,
                                 std::strerror(problem), range,
                                 info->flags & V4L2_CTRL_FLAG_READ_ONLY ? "; read-only" : ""));
  return get(info->id).value_or(control.value);
}

std::vector<V4l2Control> V4l2Controls::switch_automatics_off(const std::vector<V4l2Control>& but,
                                                             std::vector<std::string>& stubborn) {
  std::vector<V4l2Control> set;
  for (const V4l2ControlInfo& control : all_) {
    const auto manual =
        std::find_if(kManual.begin(), kManual.end(), [&](const Manual& m) { return m.id == control.id; });
    const bool kept =
        std::any_of(but.begin(), but.end(), [&](const V4l2Control& c) { return find(c.name) == &control; });
    if (manual == kManual.end() || kept) continue;
    v4l2_control wanted{control.id, manual->value};
    const int problem = get(control.id) == manual->value ? 0 : device_.call(VIDIOC_S_CTRL, &wanted);
    if (problem == 0 && get(control.id).value_or(manual->value) == manual->value)
      set.push_back({control.name, manual->value});
    else
      stubborn.push_back(control.name + " cannot be switched off" +
                         (problem != 0 ? std::string(" (") + std::strerror(problem) + ")" : ""));
  }
  return set;
}

}  // namespace tankrig
