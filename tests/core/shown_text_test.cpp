// What a message shows of a user's value.
#include "core/shown_text.hpp"

#include <gtest/gtest.h>

namespace tankrig {
namespace {

TEST(ShownText, KeepsShortPrintableTextAsItIs) {
  EXPECT_EQ(shown_text("fast"), "fast");
  EXPECT_EQ(shown_text(""), "");
  EXPECT_EQ(shown_text("3 µm, 水, 🤖"), "3 µm, 水, 🤖");
  EXPECT_EQ(shown_text(std::string(60, 'x')), std::string(60, 'x'));
}

TEST(ShownText, ClipsByCharactersNotBytes) {
  EXPECT_EQ(shown_text(std::string(61, 'x')), std::string(60, 'x') + "...");
  EXPECT_EQ(shown_text("µµµ", 2), "µµ...");
}

TEST(ShownText, HidesControlCharactersAndBytesThatAreNoText) {
  EXPECT_EQ(shown_text("a\nb\tc\x1b[31m\x7f"), "a?b?c?[31m?");
  EXPECT_EQ(shown_text(std::string_view("\0\xff\xc3", 3)), "???") << "NUL, no UTF-8, cut short";
  EXPECT_EQ(shown_text("\xc2\x9b"), "??") << "a control character of two bytes";
  EXPECT_EQ(shown_text("\xc0\xaf \xe0\x80\x80 \xed\xa0\x80"), "?? ??? ???") << "overlong and surrogate";
}

}  // namespace
}  // namespace tankrig
