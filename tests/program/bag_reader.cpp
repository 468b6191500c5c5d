#include "tests/program/bag_reader.hpp"

#include <cstring>
#include <stdexcept>

namespace tankrig::test {
namespace {

enum Op : std::uint8_t { kMessage = 2, kBagHeader = 3, kIndex = 4, kChunk = 5, kChunkInfo = 6, kConnection = 7 };

std::uint32_t number(const std::string& bytes, std::size_t at) {
  if (at + 4 > bytes.size()) throw std::runtime_error("bag: ends within a number");
  std::uint32_t value = 0;
  std::memcpy(&value, bytes.data() + at, 4);
  return value;
}

using Fields = std::map<std::string, std::string>;

Fields fields_of(const std::string& header) {
  Fields fields;
  for (std::size_t at = 0; at < header.size();) {
    const std::uint32_t length = number(header, at);
    const std::string field = header.substr(at + 4, length);
    const std::size_t equals = field.find('=');
    if (equals == std::string::npos) throw std::runtime_error("bag: a field without '='");
    fields[field.substr(0, equals)] = field.substr(equals + 1);
    at += 4 + length;
  }
  return fields;
}

class Reader {
 public:
  explicit Reader(Bag& bag) : bag_(bag) {}

  void records(const std::string& bytes, std::size_t at) {
    while (at < bytes.size()) {
      const std::uint32_t header_length = number(bytes, at);
      const Fields header = fields_of(bytes.substr(at + 4, header_length));
      const std::uint32_t data_length = number(bytes, at + 4 + header_length);
      at += 8 + header_length;
      if (at + data_length > bytes.size()) throw std::runtime_error("bag: ends within a record");
      record(header, bytes.substr(at, data_length));
      at += data_length;
    }
  }

 private:
  void record(const Fields& header, const std::string& data) {
    switch (static_cast<Op>(header.at("op").at(0))) {
      case kBagHeader:
        return;
      case kChunk:
        if (header.at("compression") != "none") throw std::runtime_error("bag: a compressed chunk");
        return records(data, 0);
      case kConnection: {
        const Fields connection = fields_of(data);
        BagTopic& topic = bag_.topics[header.at("topic")];
        topic.type = connection.at("type");
        topic.md5sum = connection.at("md5sum");
        topic.definition = connection.at("message_definition");
        names_[number(header.at("conn"), 0)] = header.at("topic");
        return;
      }
      case kMessage: {
        BagTopic& topic = bag_.topics.at(names_.at(number(header.at("conn"), 0)));
        const std::string& time = header.at("time");
        const std::uint64_t ns = number(time, 0) * 1'000'000'000ULL + number(time, 4);
        if (topic.messages == 0) topic.first_ns = ns, topic.first = data;
        topic.in_order = topic.in_order && ns >= topic.last_ns;
        topic.last_ns = ns;
        ++topic.messages;
        ++bag_.messages;
        return;
      }
      case kIndex:
        bag_.indexed += number(header.at("count"), 0);
        return;
      case kChunkInfo:
        ++bag_.chunks;
        return;
    }
    throw std::runtime_error("bag: an unknown record");
  }

  Bag& bag_;
  std::map<std::uint32_t, std::string> names_;
};

}  // namespace

void MessageFields::take(void* to, std::size_t size) {
  if (at_ + size > bytes_.size()) throw std::runtime_error("message: ends within a field");
  std::memcpy(to, bytes_.data() + at_, size);
  at_ += size;
}

std::pair<std::uint64_t, std::string> MessageFields::header() {
  next<std::uint32_t>();  // seq
  const std::uint64_t s = next<std::uint32_t>(), ns = next<std::uint32_t>();
  return {s * 1'000'000'000 + ns, text()};
}

Bag read_bag(const std::string& bytes) {
  const std::string magic = "#ROSBAG V2.0\n";
  if (bytes.compare(0, magic.size(), magic) != 0) throw std::runtime_error("bag: no bag of version 2.0");
  Bag bag;
  Reader(bag).records(bytes, magic.size());
  return bag;
}

}  // namespace tankrig::test
