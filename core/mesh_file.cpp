#include "core/mesh_file.hpp"

#include <fmt/core.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdint>
#include <sstream>

#include "core/input_error.hpp"
#include "core/regular_file.hpp"

namespace tankrig {
namespace {

/// The beginning of a mesh file, and how long the whole is.
struct Beginning {
  std::filesystem::path file;
  std::string text;
  std::uint64_t bytes = 0;

  [[noreturn]] void refuse(const std::string& found, const std::string& expected) const {
    throw InputError(file, fmt::format("found {} in a file of {} bytes, expected {}", found, bytes, expected));
  }
};

Beginning beginning_of(const std::filesystem::path& file) {
  constexpr std::size_t kHeaderBytes = 1 << 14;  // of a PLY with many properties and comments
  const std::string expected = "a triangle mesh file";
  const int descriptor = open_regular_file(file, kMostMeshBytes, expected);
  Beginning out{file, std::string(kHeaderBytes, '\0'), 0};
  struct stat status {};
  const ssize_t got = ::pread(descriptor, out.text.data(), out.text.size(), 0);
  const bool known = ::fstat(descriptor, &status) == 0;
  ::close(descriptor);
  if (got < 0 || !known) throw InputError(file, "cannot be read, expected " + expected);
  out.text.resize(static_cast<std::size_t>(got));
  out.bytes = static_cast<std::uint64_t>(status.st_size);
  return out;
}

/// Magic, version and length of the whole; then length and kind of the first part.
void check_binary_gltf(const Beginning& glb) {
  constexpr std::size_t kHeaderBytes = 20;
  const std::string expected = "a binary glTF that is whole";
  if (!glb.text.starts_with("glTF") || glb.text.size() < kHeaderBytes) glb.refuse("no glTF header", expected);
  const auto number = [&](std::size_t at) {
    std::uint64_t value = 0;
    for (std::size_t i = 4; i-- > 0;) value = value << 8 | static_cast<unsigned char>(glb.text[at + i]);
    return value;
  };
  const std::uint64_t whole = number(8), first_part = number(12);
  if (whole < kHeaderBytes || whole > glb.bytes || first_part > glb.bytes - kHeaderBytes)
    glb.refuse(fmt::format("a header of {} bytes, the first part {}", whole, first_part), expected);
}

void check_count(const Beginning& mesh, std::uint64_t count) {
  if (count > mesh.bytes) mesh.refuse(fmt::format("{} elements", count), "a mesh that is whole");
}

void check_ply(const Beginning& ply) {
  std::istringstream words(ply.text.substr(0, ply.text.find("end_header")));
  for (std::string word, name; words >> word;) {
    std::uint64_t count = 0;
    if (word == "element" && words >> name >> count) check_count(ply, count);
    words.clear();
  }
}

/// After its magic, where it has one: how many vertices and faces.
void check_off(const Beginning& off) {
  std::istringstream words(off.text);
  std::string magic;
  if (!off.text.empty() && (off.text[0] < '0' || off.text[0] > '9')) words >> magic;
  for (std::string comment; (words >> std::ws).peek() == '#';) std::getline(words, comment);
  std::uint64_t vertices = 0, faces = 0;
  words >> vertices >> faces;
  check_count(off, vertices);
  check_count(off, faces);
}

}  // namespace

void check_mesh_file(const std::filesystem::path& file) {
  const Beginning mesh = beginning_of(file);
  std::string ending = file.extension().string();
  for (char& c : ending) c = static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
  if (mesh.text.starts_with("glTF") || ending == ".glb") check_binary_gltf(mesh);
  if (mesh.text.starts_with("ply") || mesh.text.starts_with("PLY")) check_ply(mesh);
  if (mesh.text.starts_with("OFF") || ending == ".off") check_off(mesh);
}

}  // namespace tankrig
