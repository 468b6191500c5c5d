#include "console/server/page_version.hpp"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <array>

#include "console/server/site.hpp"

namespace tankrig {

std::string page_version() {
  static const std::string version = [] {
    std::string all;
    for (const char* path : {"/", "/console.css", "/console.js"})
      if (const auto file = site_file(path)) all += file->text;
    std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
    EVP_Digest(all.data(), all.size(), digest.data(), nullptr, EVP_sha256(), nullptr);
    return fmt::format("{:02x}{:02x}{:02x}{:02x}", digest[0], digest[1], digest[2], digest[3]);
  }();
  return version;
}

std::string page_with_version() {
  std::string page(site_file("/")->text);
  const std::string place = "@version@";
  if (const std::size_t at = page.find(place); at != std::string::npos) page.replace(at, place.size(), page_version());
  return page;
}

}  // namespace tankrig
