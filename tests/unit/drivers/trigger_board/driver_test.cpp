
#include "drivers/serial/serial.hpp"
#include "tests/support/mentions.hpp"
#include "tests/unit/drivers/trigger_board/rig.hpp"

namespace vergence::trigger_board {
namespace {

/// A machine with ports: at some of them boards, at the others nothing that answers.
struct Machine {
  struct Port {
    SerialPortInfo info;
    // Null if the port does not open.
    std::shared_ptr<test::DeviceModel> device;
  };
  std::vector<Port> ports;

  void add_board(const char* port, std::uint8_t last_of_serial) {
    test::BoardSimulatorOptions o;
    o.serial[11] = last_of_serial;
    // A board's own USB supports every rate; this one supports the first only.
    o.baud = 115200;
    ports.push_back({{port, "", 0x0483, 0x5740, "", {}},
                     std::make_shared<test::BoardSimulator>(test::PulseSource{}, o)});
  }
  void add(const char* port, std::uint16_t vendor, std::uint16_t product) {
    ports.push_back(
        {{port, "", vendor, product, "", {}}, std::make_shared<test::Talker>("", 115200)});
  }
  std::vector<std::string> asked;
  Driver driver() {
    return Driver({}, {[this] {
                         std::vector<SerialPortInfo> list;
                         for (const Port& p : ports) list.push_back(p.info);
                         return list;
                       },
                       [this](const std::string& name) -> std::unique_ptr<SerialLinkFactory> {
                         asked.push_back(name);
                         for (const Port& p : ports)
                           if (p.info.port == name && p.device != nullptr)
                             return std::make_unique<test::SimulatedLinkFactory>(
                                 p.device, test::direct_line());
                         return std::make_unique<SerialPort>("/dev/ttyThatIsNotThere");
                       }});
  }
};

TEST(Driver, listsBoardsWithoutAskingAnIns) {
  Machine m;
  m.add("/dev/ttyS0", 0, 0);
  m.add("/dev/ttyUSB0", 0x0403, 0xD388);
  m.add("/dev/ttyUSB1", 0x2639, 0x0300);
  m.add("/dev/ttyUSB2", 0x0403, 0x6001);
  m.add_board("/dev/ttyACM0", 0xAA);
  m.add_board("/dev/ttyACM1", 0xBB);
  m.ports.push_back({{"/dev/ttyUSB9", "", 0x0403, 0x6001, "", {}}, nullptr});
  Driver driver = m.driver();
  const auto found = driver.enumerate();
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].serial, "30002b000b513336343931aa");
  EXPECT_EQ(found[1].serial, "30002b000b513336343931bb");
  EXPECT_EQ(found[0].driver, "board");
  EXPECT_EQ(m.asked, (std::vector<std::string>{"/dev/ttyUSB2", "/dev/ttyACM0", "/dev/ttyACM1",
                                               "/dev/ttyUSB9"}));
}

TEST(Driver, opensByPortSerialNumberOrTheOnlyBoard) {
  Machine m;
  m.add_board("/dev/ttyACM0", 0xAA);
  Driver driver = m.driver();
  DeviceStatus s = DeviceStatus::failed;
  EXPECT_NE(driver.open("", &s), nullptr) << driver.last_error();
  EXPECT_EQ(s, DeviceStatus::ok);
  EXPECT_NE(driver.open("/dev/ttyACM0", &s), nullptr);
  m.add_board("/dev/ttyACM1", 0xBB);
  EXPECT_EQ(driver.open("", &s), nullptr);
  EXPECT_EQ(s, DeviceStatus::bad_configuration) << "which of the two nobody has said";
  EXPECT_TRUE(test::mentions(driver.last_error(), "trigger.port"));
  const auto one = driver.open("30002b000b513336343931bb", &s);
  ASSERT_NE(one, nullptr) << driver.last_error();
  EXPECT_EQ(one->info().serial, "30002b000b513336343931bb");
  EXPECT_EQ(driver.open("30002b000b513336343931cc", &s), nullptr);
  EXPECT_EQ(s, DeviceStatus::not_found);
  EXPECT_TRUE(test::mentions(driver.last_error(), "30002b000b513336343931cc"));
}

}  // namespace
}  // namespace vergence::trigger_board
