#include "drivers/arm/known_zero.hpp"

#include <utility>

namespace tankrig {

void KnownZero::set_proof(ZeroProof proof) {
  may_move_ = false;
  proof_ = std::move(proof);
}

const ArmZero* KnownZero::judge(const std::array<std::uint16_t, kJoints>& raw) noexcept {
  if (!proof_ || !proof_->undecided()) return nullptr;
  if (!proof_->judge(raw)) {
    lost_ = "the encoders do not read what they read when it was left";
    return nullptr;
  }
  known_ = true;
  raw_ = proof_->zero()->raw;
  return &*proof_->zero();
}

std::optional<ExpectedZero> KnownZero::expected(const std::array<std::uint16_t, kJoints>& raw) const noexcept {
  if (known()) return ExpectedZero{raw_, true};
  if (!proof_ || !proof_->zero() || !proof_->zero()->exit) return {};
  const ArmZero& last = *proof_->zero();
  ExpectedZero expected;
  for (std::size_t j = 0; j < kJoints; ++j)
    expected.raw[j] = static_cast<std::uint16_t>(last.raw[j] - last.exit->raw[j] + raw[j]);
  return expected;
}

void KnownZero::set(const ArmZero& zero) noexcept {
  known_ = true;
  raw_ = zero.raw;
  lost_ = nullptr;
  if (proof_) proof_->replace(zero);
}

void KnownZero::lose(const char* why) noexcept {
  known_ = false;
  lost_ = why;
}

std::string KnownZero::why_not() const {
  if (!proof_ || known()) return {};
  const std::string why = proof_->why_not();
  return why.empty() && lost_ ? lost_ : why;
}

void KnownZero::begin_motion() {
  if (proof_) proof_->begin_motion();
  may_move_ = true;
}

void KnownZero::end_motion(const std::optional<std::array<std::uint16_t, kJoints>>& at_rest) {
  if (!proof_) return;
  may_move_ = false;
  keep_loss();
  proof_->end_motion(known() ? at_rest : std::nullopt);
}

void KnownZero::keep_loss() {
  if (proof_ && lost_) proof_->void_it(why_not());
}

}  // namespace tankrig
