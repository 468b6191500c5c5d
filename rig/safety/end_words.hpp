// What a stop has confirmed, and what the people at the tank must do where it has not: the words that every program says.
#pragma once

namespace tankrig {

inline constexpr char kLaserOff[] = "laser off", kCutLaser[] = "LASER MAY BE ON: cut its supply",
                      kArmAtRest[] = "arm at rest", kCutArm[] = "ARM MAY BE MOVING: cut its power";

}  // namespace tankrig
