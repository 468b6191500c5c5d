// The better stripe detector: any colour, width and brightness, measured in the image itself.
//
// find/:
//  1. background removed: the dark image where there is one; else by the filter's zero mean, less what is brighter than
//  one side only, and nothing is found where dark lines are as clear as bright ones
//  2. stripe colour and width measured on some columns; channels weighted by the inverse covariance of noise and
//  texture: the whole scene's to find it, the surface's beside it to fit it
//  3. matched filter across the stripe (negated second derivative of a Gauss; with a dark image a wide one at every
//  second row), noise by MAD, candidates by SNR
//  4. path of most evidence through the candidates of all columns (dynamic programming), which pays for jumps
// fit/:
//  5. sub-pixel: least squares of a Gaussian profile on its background, weighted with the noise of each pixel: the
//  image's own, and speckle's, which is in proportion to the light; its contrast is measured in the image. A clipped
//  plateau: both of its flanks at once, what is clipped being a lower bound; or the channel that does not clip
//  6. haze that lies more on one side, in the mean of many profiles: positions move by what it has drawn them
// runs/:
//  7. points that are wide, lopsided, beside a jump, in the blur beyond an edge, alone, of another colour, without added
//  light or doubled by a reflection are rejected and counted
//  8. sigma from noise and residuals, then calibrated by how the points scatter along the stripe, near and over 40
//  columns: what neighbours share is an error, too; after smoothing by how far they are from a parabola over 56
//  9. a local line along the stripe, bent as its neighbours are, that stops at corners
// Sources: Steger 1998 (filter), Naidu & Fisher 1991 (sub-pixel), Viterbi 1967 (path).
#pragma once

#include "reconstruction/stripe/find/stripe_look.hpp"
#include "reconstruction/stripe/fit/speckle_contrast.hpp"
#include "reconstruction/stripe/stripe.hpp"
#include "reconstruction/stripe/stripe_parameters.hpp"

namespace tankrig {

/// `image`: 8-bit, 1 or 3 (BGR) channels. `background`: the same scene without laser, empty if there is none.
/// Without a background a line of the scene that is brighter than its surroundings in all channels may be taken for the
/// stripe when the laser is off.
/// Errors: InputError for another type or another background size.
StripeDetection detect_stripe(const cv::Mat& image, const cv::Mat& background, const StripeParameters& parameters);

/// The same for an image of a set whose stripe's look is known from some of them.
StripeDetection detect_stripe(const cv::Mat& image, const cv::Mat& background, const StripeParameters& parameters,
                              const StripeLook& known);

/// Of some clear sections of the stripe in one image.
ContrastScatters measure_contrasts(const cv::Mat& image, const cv::Mat& background, const StripeParameters& parameters,
                                   const StripeLook& known);

}  // namespace tankrig
