// How much of a stripe's noise is speckle, in proportion to its light: the share with which its points are straightest.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "reconstruction/stripe/find/stripe_path.hpp"

namespace tankrig {

class SectionFits;

/// How far neighbouring points are out of line for each share of speckle; those of several images are summed.
class ContrastScatters {
 public:
  static constexpr std::array kContrasts{0.0, 0.15, 0.4, 0.7};

  void add(std::size_t contrast, double square);  ///< of a point's distance from the line of two others [px^2]
  ContrastScatters& operator+=(const ContrastScatters& other);
  double best() const;  ///< the first where too little was seen

 private:
  std::array<double, kContrasts.size()> sums_{};  ///< of logarithms: one gross point says no more than one small one
  std::array<std::size_t, kContrasts.size()> counts_{};
};

/// On some sections that are not clipped. What is off a Gauss is not speckle, though its residuals look alike.
ContrastScatters scatters_along(const std::vector<StripeRun>& path, SectionFits& fits);

}  // namespace tankrig
