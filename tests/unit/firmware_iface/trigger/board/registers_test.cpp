// The port of STM32F405 against its registers as plain memory at their addresses: what is written
// where, and what its interrupts make of what the units report. Values are worked out by hand from
// the reference manual's bit tables. What hardware does to flags that are cleared by writing is not
// in this memory: each test sets them as they would stand.
#include <gtest/gtest.h>
#include <sys/mman.h>

#include <cstdint>
#include <cstring>

extern "C" {
#include "firmware_iface/trigger/board/hal.h"
#include "firmware_iface/trigger/board/stm32f405/port.h"

// processor.c is not in this program.
void irq_enable(unsigned, std::uint8_t) {}
std::uint32_t irq_off() { return 0; }
void irq_restore(std::uint32_t) {}
}

namespace vergence {
namespace {

constexpr std::uintptr_t kBegin = 0x40000000, kSize = 0x30000;
constexpr std::uintptr_t kTim2 = 0x40000000, kTim4 = 0x40000800, kTim5 = 0x40000C00,
                         kUsart1 = 0x40011000, kSyscfg = 0x40013800, kExti = 0x40013C00,
                         kGpioa = 0x40020000, kGpiob = 0x40020400;
// Registers of a timer, of a GPIO port and of EXTI.
constexpr std::uintptr_t cr1 = 0x00, cr2 = 0x04, smcr = 0x08, dier = 0x0C, sr = 0x10, ccmr1 = 0x18,
                         ccmr2 = 0x1C, ccer = 0x20, cnt = 0x24, psc = 0x28, arr = 0x2C, ccr1 = 0x34,
                         ccr2 = 0x38, ccr3 = 0x3C, ccr4 = 0x40;
constexpr std::uintptr_t moder = 0x00, afrl = 0x20, afrh = 0x24;
constexpr std::uintptr_t imr = 0x00, rtsr = 0x08, ftsr = 0x0C, pr = 0x14;

volatile std::uint32_t& at(std::uintptr_t unit, std::uintptr_t offset) {
  return *reinterpret_cast<volatile std::uint32_t*>(
      unit + offset);  // NOLINT(performance-no-int-to-ptr): that is what a register is
}

struct BoardPort : testing::Test {
  static void SetUpTestSuite() {
    void* const want = reinterpret_cast<void*>(kBegin);  // NOLINT(performance-no-int-to-ptr)
    mapped = mmap(want, kSize, PROT_READ | PROT_WRITE,
                  MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED_NOREPLACE, -1, 0) == want;
  }
  static void TearDownTestSuite() {
    if (mapped)
      munmap(reinterpret_cast<void*>(kBegin), kSize);  // NOLINT(performance-no-int-to-ptr)
  }
  void SetUp() override {
    if (!mapped)
      GTEST_SKIP()
          << "needs 0x40000000 to 0x40030000, where the board's registers are, unmapped in "
             "this process: run the test again (the address layout is random)";
    std::memset(reinterpret_cast<void*>(kBegin), 0, kSize);  // NOLINT(performance-no-int-to-ptr)
    StampRecord record{};
    while (hal_stamped(&record)) {
    }
    inputs_start();
    pulses_start();
  }
  static TriggerConfig config() {
    return {0, 0, 0, 0x5, 0x4, 0x3, 0, trigger_edge_rising, trigger_edge_falling};
  }
  static void configure() {
    const TriggerConfig c = config();
    hal_configure(&c);
  }
  /// The only record there is.
  static StampRecord stamped() {
    StampRecord record{}, other{};
    EXPECT_TRUE(hal_stamped(&record));
    EXPECT_FALSE(hal_stamped(&other));
    return record;
  }
  static bool nothing_stamped() {
    StampRecord record{};
    return !hal_stamped(&record);
  }
  static inline bool mapped = false;
};

TEST_F(BoardPort, startSynchronisesTimersAndPairsCaptures) {
  EXPECT_EQ(at(kTim2, arr), 0xFFFFFFFFU);
  EXPECT_EQ(at(kTim2, psc), 0U);
  EXPECT_EQ(at(kTim2, cr2), 0x10U) << "MMS 001: enable is the trigger";
  EXPECT_EQ(at(kTim2, cr1), 1U);
  EXPECT_EQ(at(kTim5, smcr), 0x06U) << "trigger mode, ITR0: TIM2";
  EXPECT_EQ(at(kTim5, arr), 0xFFFFFFFFU);
  EXPECT_EQ(at(kTim5, ccmr1), 0x3231U) << "both channels on TI1, filter 3";
  EXPECT_EQ(at(kTim5, ccmr2), 0x3231U) << "both channels on TI3";
  EXPECT_EQ(at(kTim4, smcr), 0x16U) << "trigger mode, ITR1: TIM2";
  EXPECT_EQ(at(kTim4, arr), 0xFFFFU);
  EXPECT_EQ(at(kTim4, ccmr1), 0x3131U);
  EXPECT_EQ(at(kSyscfg, 0x0C), 0x1100U) << "EXTI6 and EXTI7 are port B's";
  EXPECT_EQ(at(kGpioa, moder) & 0x33U, 0x22U) << "PA0, PA2";
  EXPECT_EQ(at(kGpioa, afrl) & 0xF0FU, 0x202U);
  EXPECT_EQ(at(kGpiob, moder) & 0xF000U, 0xA000U) << "PB6, PB7";
  EXPECT_EQ(at(kGpiob, afrl) >> 24U, 0x22U);
  EXPECT_EQ(at(kGpioa, moder) & 0xC0CU, 0U) << "lines are high-impedance before the first CONFIG";
  EXPECT_EQ(at(kGpiob, moder) & 0xF00000U, 0U);
}

TEST_F(BoardPort, configurationSetsPolaritiesAndPins) {
  configure();
  EXPECT_EQ(at(kTim2, ccer), 0x301U) << "CC1E; CC3E, CC3P";
  EXPECT_EQ(at(kTim2, ccmr1), 0x4040U) << "all forced inactive";
  EXPECT_EQ(at(kTim2, ccmr2), 0x4040U);
  EXPECT_EQ(at(kGpioa, moder) & 0xC0CU, 0x800U) << "PA5 alternate, PA1 not";
  EXPECT_EQ(at(kGpioa, afrl) >> 20U & 0xFU, 1U);
  EXPECT_EQ(at(kGpiob, moder) & 0xF00000U, 0x200000U) << "PB10 alternate, PB11 not";
  EXPECT_EQ(at(kGpiob, afrh) >> 8U & 0xFU, 1U);
  EXPECT_EQ(at(kTim5, ccer), 0x3131U) << "rising on channels 1 and 3, falling on 2 and 4";
  EXPECT_EQ(at(kTim5, dier), 0x1EU);
  EXPECT_EQ(at(kTim4, ccer), 0x31U) << "PPS rising, INS falling";
  EXPECT_EQ(at(kExti, imr), 0xC0U);
  EXPECT_EQ(at(kExti, rtsr), 0x40U);
  EXPECT_EQ(at(kExti, ftsr), 0x80U);
  TriggerConfig none{};
  none.lines = 0x8;
  hal_configure(&none);
  EXPECT_EQ(at(kTim2, ccer), 0x1000U);
  EXPECT_EQ(at(kGpioa, moder) & 0xC0CU, 0U);
  EXPECT_EQ(at(kGpiob, moder) & 0xF00000U, 0x800000U);
  EXPECT_EQ(at(kTim5, dier), 0U);
  EXPECT_EQ(at(kExti, imr), 0U);
}

TEST_F(BoardPort, compareUnitMakesBothEdgesOfAllLines) {
  configure();
  at(kTim2, cnt) = 1000;
  ASSERT_TRUE(hal_arm(11'000, 500, 0x5));
  EXPECT_EQ(at(kTim2, ccr1), 11'000U);
  EXPECT_EQ(at(kTim2, ccr3), 11'000U);
  EXPECT_EQ(at(kTim2, ccr2), 0U);
  EXPECT_EQ(at(kTim2, ccmr1), 0x4010U) << "active on match";
  EXPECT_EQ(at(kTim2, ccmr2), 0x4010U);
  EXPECT_EQ(at(kTim2, dier), 2U) << "the lowest line stands for all";
  EXPECT_FALSE(hal_arm(20'000, 500, 0x5)) << "one at a time";
  EXPECT_TRUE(nothing_stamped());

  at(kTim2, sr) = 2;
  at(kTim2, cnt) = 11'030;
  tim2_handler();
  const StampRecord edge = stamped();
  EXPECT_EQ(edge.count, 11'000U) << "the edge, not the interrupt";
  EXPECT_EQ(edge.source, record_pulse);
  EXPECT_FALSE(edge.late);
  EXPECT_EQ(at(kTim2, ccr1), 11'500U);
  EXPECT_EQ(at(kTim2, ccr3), 11'500U);
  EXPECT_EQ(at(kTim2, ccmr1), 0x4020U) << "inactive on match";
  EXPECT_EQ(at(kTim2, ccmr2), 0x4020U);

  at(kTim2, sr) = 2;
  at(kTim2, cnt) = 11'530;
  tim2_handler();
  EXPECT_TRUE(nothing_stamped());
  EXPECT_EQ(at(kTim2, ccmr1), 0x4040U);
  EXPECT_EQ(at(kTim2, dier), 0U);
  EXPECT_TRUE(hal_arm(20'000, 500, 0x5));
}

TEST_F(BoardPort, interruptAfterThePulseEndsIt) {
  configure();
  ASSERT_TRUE(hal_arm(11'000, 500, 0x4));
  EXPECT_EQ(at(kTim2, dier), 8U);
  at(kTim2, sr) = 8;
  at(kTim2, cnt) = 12'000;
  tim2_handler();
  EXPECT_EQ(stamped().count, 11'000U);
  EXPECT_EQ(at(kTim2, ccmr2), 0x4040U);
  EXPECT_EQ(at(kTim2, dier), 0U);
}

TEST_F(BoardPort, armAndDisarmAreRefusedTooNearTheEdge) {
  configure();
  at(kTim2, cnt) = 0xFFFFFF00;
  EXPECT_FALSE(hal_arm(0x00000080, 500, 0x1)) << "384 counts away, across the counter's wrap";
  EXPECT_EQ(at(kTim2, dier), 0U);
  EXPECT_FALSE(hal_arm(0xFFFFFE00, 500, 0x1)) << "past";
  ASSERT_TRUE(hal_arm(0x00000400, 500, 0x1));
  at(kTim2, cnt) = 0x00000300;
  EXPECT_FALSE(hal_disarm());
  at(kTim2, cnt) = 0x00000100;
  at(kTim2, sr) = 0;
  EXPECT_TRUE(hal_disarm());
  EXPECT_EQ(at(kTim2, ccmr1), 0x4040U);
  EXPECT_EQ(at(kTim2, dier), 0U);
  EXPECT_FALSE(hal_disarm()) << "nothing is armed";
  EXPECT_TRUE(nothing_stamped());
}

TEST_F(BoardPort, missedEdgesAreForcedAndFlaggedLate) {
  configure();
  ASSERT_TRUE(hal_arm(11'000, 500, 0x1));
  at(kTim2, sr) = 0;
  at(kTim2, cnt) = 111'000;
  hal_check_pulse();
  EXPECT_TRUE(nothing_stamped()) << "not yet";
  at(kTim2, cnt) = 111'001;
  at(kTim2, sr) = 2;
  hal_check_pulse();
  EXPECT_TRUE(nothing_stamped()) << "its interrupt is on the way";
  at(kTim2, sr) = 0;
  hal_check_pulse();
  const StampRecord edge = stamped();
  EXPECT_EQ(edge.count, 111'001U);
  EXPECT_TRUE(edge.late);
  EXPECT_EQ(at(kTim2, ccr1), 111'501U);
  EXPECT_EQ(at(kTim2, ccmr1), 0x4020U);
  at(kTim2, cnt) = 300'000;
  hal_check_pulse();
  EXPECT_EQ(at(kTim2, ccmr1), 0x4040U);
  EXPECT_TRUE(nothing_stamped());
}

TEST_F(BoardPort, exposureEdgesAreStampedByCapture) {
  configure();
  at(kTim5, sr) = 0x2;
  at(kTim5, ccr1) = 5000;
  tim5_handler();
  StampRecord r = stamped();
  EXPECT_EQ(r.source, board_input_feedback);
  EXPECT_EQ(r.count, 5000U);
  EXPECT_TRUE(r.rising);
  at(kTim5, sr) = 0x10;
  at(kTim5, ccr4) = 6000;
  tim5_handler();
  r = stamped();
  EXPECT_EQ(r.source, board_input_feedback + 1);
  EXPECT_EQ(r.count, 6000U);
  EXPECT_FALSE(r.rising);

  // Both edges of both inputs in one interrupt, of the first the falling one earlier, across the
  // wrap.
  at(kTim5, sr) = 0x1E;
  at(kTim5, ccr1) = 0x00000010;
  at(kTim5, ccr2) = 0xFFFFFFF0;
  at(kTim5, ccr3) = 100;
  at(kTim5, ccr4) = 200;
  tim5_handler();
  const bool rising[] = {false, true, true, false};
  const std::uint32_t counts[] = {0xFFFFFFF0, 0x10, 100, 200};
  for (int i = 0; i < 4; ++i) {
    ASSERT_TRUE(hal_stamped(&r));
    EXPECT_EQ(r.count, counts[i]);
    EXPECT_EQ(r.rising, rising[i]);
    EXPECT_EQ(r.source, board_input_feedback + i / 2);
  }
  const std::uint32_t lost = hal_stamps_lost();
  at(kTim5, sr) = 0x2 | 0x200;
  tim5_handler();
  EXPECT_EQ(hal_stamps_lost(), lost + 1) << "a capture that overwrote another";
  (void)stamped();
}

TEST_F(BoardPort, ppsAndInsUseCaptureElseInterruptTime) {
  configure();
  at(kTim2, cnt) = 0x12345678;
  at(kExti, pr) = 0x40;
  at(kTim4, sr) = 0x2;
  at(kTim4, ccr1) = 0x5600;
  exti9_5_handler();
  StampRecord r = stamped();
  EXPECT_EQ(r.source, board_input_pps);
  EXPECT_TRUE(r.rising);
  EXPECT_EQ(r.count, 0x12345600U);

  at(kTim2, cnt) = 0x12340010;
  at(kExti, pr) = 0x80;
  at(kTim4, sr) = 0x4;
  at(kTim4, ccr2) = 0xFFF0;
  exti9_5_handler();
  r = stamped();
  EXPECT_EQ(r.source, board_input_ins);
  EXPECT_FALSE(r.rising);
  EXPECT_EQ(r.count, 0x1233FFF0U) << "before the 16 bits wrapped";

  at(kExti, pr) = 0x40;
  at(kTim4, sr) = 0;
  exti9_5_handler();
  EXPECT_EQ(stamped().count, 0x12340010U) << "no capture came";
}

TEST_F(BoardPort, lineRunsAt921600AndStampsItsBytes) {
  line_start(84'000'000);
  EXPECT_EQ(at(kUsart1, 0x08), 91U) << "84 MHz / 91 = 923 077, 0.16 % fast";
  EXPECT_EQ(at(kUsart1, 0x0C), 0x202CU) << "UE, RXNEIE, TE, RE";
  EXPECT_EQ(at(kGpioa, moder) >> 18U & 0xFU, 0xAU) << "PA9, PA10";
  EXPECT_EQ(at(kGpioa, afrh) >> 4U & 0xFFU, 0x77U);
  EXPECT_EQ(at(kGpioa, 0x0C) >> 20U & 3U, 1U) << "pull-up at RX";
  ByteRecord byte{};
  at(kUsart1, 0x00) = 0x20;
  at(kUsart1, 0x04) = 0x155;
  at(kTim2, cnt) = 777;
  usart1_handler();
  ASSERT_TRUE(hal_received(&byte));
  EXPECT_EQ(byte.byte, 0x55);
  EXPECT_EQ(byte.count, 777U);
  at(kUsart1, 0x00) = 0x08;
  usart1_handler();
  EXPECT_FALSE(hal_received(&byte)) << "an overrun alone has no byte";
  EXPECT_FALSE(hal_send(1));
  EXPECT_FALSE(hal_line_idle());
  at(kUsart1, 0x00) = 0xC0;
  EXPECT_TRUE(hal_line_idle());
  EXPECT_TRUE(hal_send(0xA5));
  EXPECT_EQ(at(kUsart1, 0x04), 0xA5U);
}

}  // namespace
}  // namespace vergence
