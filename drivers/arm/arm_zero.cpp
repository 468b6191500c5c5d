#include "drivers/arm/arm_zero.hpp"

#include <fmt/format.h>

#include "core/atomic_file.hpp"
#include "core/config_node.hpp"

namespace tankrig {
namespace {

std::array<std::uint16_t, kJoints> raw_from(const ConfigNode& node) {
  std::array<std::uint16_t, kJoints> raw;
  for (std::size_t j = 0; j < kJoints; ++j)
    raw[j] = static_cast<std::uint16_t>(node.integer(kJointNames[j], {0, 65535}));
  return raw;
}

std::string yaml_of(const std::array<std::uint16_t, kJoints>& raw, std::string_view indent) {
  std::string text;
  for (std::size_t j = 0; j < kJoints; ++j) text += fmt::format("{}{}: {}\n", indent, kJointNames[j], raw[j]);
  return text;
}

}  // namespace

ArmZero load_arm_zero(const std::filesystem::path& file) {
  const ConfigNode node = ConfigNode::load(file);
  ArmZero zero;
  zero.taken = node.text("taken");
  zero.raw = raw_from(node.child("raw_ticks_at_zero"));
  if (const auto exit = node.optional_child("orderly_exit"))
    zero.exit = {raw_from(exit->child("raw_ticks")), exit->text("at")};
  zero.voided = node.text_or("voided", "");
  node.finish();
  return zero;
}

void save_arm_zero(const std::filesystem::path& file, const ArmZero& zero) {
  std::string text = fmt::format(
      "# Raw encoder readings at the actuators' tick 0. Void as soon as the arm has been without supply: home again.\n"
      "taken: \"{}\"\nraw_ticks_at_zero:\n{}",
      zero.taken, yaml_of(zero.raw, "  "));
  if (zero.exit)
    text += fmt::format(
        "# Where the program that moved the arm last left it, at rest. Without it the zero is not believed.\n"
        "orderly_exit:\n  at: \"{}\"\n  raw_ticks:\n{}",
        zero.exit->at, yaml_of(zero.exit->raw, "    "));
  if (!zero.voided.empty()) text += fmt::format("voided: \"{}\"\n", zero.voided);
  write_file_durably(file, text);
}

}  // namespace tankrig
