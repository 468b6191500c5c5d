#include "session/checking/sha256.hpp"

#include <fmt/format.h>
#include <openssl/evp.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <limits>
#include <memory>
#include <stdexcept>
#include <vector>

#include "core/input_error.hpp"
#include "core/regular_file.hpp"

namespace tankrig {
namespace {

class Sum {
 public:
  Sum() : context_(EVP_MD_CTX_new(), EVP_MD_CTX_free) {
    check(context_ && EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr));
  }
  void add(std::string_view bytes) { check(EVP_DigestUpdate(context_.get(), bytes.data(), bytes.size())); }
  std::string hex() {
    std::array<unsigned char, 32> digest{};
    check(EVP_DigestFinal_ex(context_.get(), digest.data(), nullptr));
    return fmt::format("{:02x}", fmt::join(digest, ""));
  }

 private:
  static void check(bool done) {
    if (!done) throw std::runtime_error("SHA-256: the cryptographic library refuses it");
  }

  std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context_;
};

}  // namespace

std::string sha256_of_text(std::string_view text) {
  Sum sum;
  sum.add(text);
  return sum.hex();
}

std::string sha256_of_file(const std::filesystem::path& file) {
  Sum sum;
  std::vector<char> buffer(1 << 16);
  const int descriptor = open_regular_file(file, std::numeric_limits<std::uint64_t>::max(), "a file");
  ssize_t got = 0;
  do {
    got = ::read(descriptor, buffer.data(), buffer.size());
    if (got > 0) sum.add({buffer.data(), static_cast<std::size_t>(got)});
  } while (got > 0 || (got < 0 && errno == EINTR));
  ::close(descriptor);
  if (got < 0) throw InputError(file, "cannot be read to its end");
  return sum.hex();
}

}  // namespace tankrig
