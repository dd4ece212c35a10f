//! The pins of a Raspberry Pi Pico 2: which sensor is which input, which output drives what, and what is safe.
//!
//! | pin | what |
//! |---|---|
//! | GP26, GP27, GP28 | the first three sensors, 0 to 3.3 V |
//! | GP0, GP2, GP4 | the actuators: pulses of 20 kHz, half on for 0, as a bridge in locked antiphase takes them |
//! | GP14 | to ground: the policy may drive; open: it may not |
//! | GP15 | high while the policy drives: the enable input of the motor drivers. A resistor holds it low while the chip starts. |

use embedded_hal::digital::{InputPin as _, OutputPin as _};
use embedded_hal::pwm::SetDutyCycle as _;
use embedded_hal_0_2::adc::OneShot as _;
use rp235x_hal::adc::{Adc, AdcPin};
use rp235x_hal::clocks::init_clocks_and_plls;
use rp235x_hal::fugit::ExtU32 as _;
use rp235x_hal::gpio::bank0::{Gpio14, Gpio15, Gpio26, Gpio27, Gpio28};
use rp235x_hal::gpio::{
    FunctionNull, FunctionSioInput, FunctionSioOutput, Pin, PinState, Pins, PullDown, PullNone,
    PullUp,
};
use rp235x_hal::pwm::{FreeRunning, Pwm0, Pwm1, Pwm2, Slice, Slices};
use rp235x_hal::timer::{CopyableTimer0, Timer};
use rp235x_hal::{Sio, Watchdog, pac};
use tpg_board::control::{Channel, Plant};
use tpg_runtime::Action;

/// The crystal of the Pico 2, in hertz.
const CRYSTAL_HZ: u32 = 12_000_000;
/// Steps of a pulse: the system's 150 MHz by 20 kHz.
const PULSE_STEPS: u16 = 7_500;

/// edit 5: your sensors, in the policy's order; `tpg inspect` lists its inputs. Zero and scale are examples.
pub const SENSORS: [Channel; 11] = [
    sensor("torso_height", "m", 0.0, 2.0 / 4096.0),
    sensor("torso_angle", "rad", 2048.0, 3.0 / 4096.0),
    sensor("thigh_angle", "rad", 2048.0, 3.0 / 4096.0),
    sensor("leg_angle", "rad", 0.0, 1.0),
    sensor("foot_angle", "rad", 0.0, 1.0),
    sensor("torso_forward_velocity", "m/s", 0.0, 1.0),
    sensor("torso_upward_velocity", "m/s", 0.0, 1.0),
    sensor("torso_angular_velocity", "rad/s", 0.0, 1.0),
    sensor("thigh_angular_velocity", "rad/s", 0.0, 1.0),
    sensor("leg_angular_velocity", "rad/s", 0.0, 1.0),
    sensor("foot_angular_velocity", "rad/s", 0.0, 1.0),
];

/// edit 6: your actuators, in the policy's order. Zero is the step at which they do nothing.
pub const ACTUATORS: [Channel; 3] = [
    actuator("thigh_torque", "200 N m"),
    actuator("leg_torque", "200 N m"),
    actuator("foot_torque", "200 N m"),
];

const fn sensor(
    name: &'static str,
    unit: &'static str,
    zero_step: f32,
    unit_per_step: f32,
) -> Channel {
    Channel {
        label: (name, unit),
        zero_step,
        unit_per_step,
    }
}

/// One unit is a pulse that is on all the time, minus one a pulse that is never on.
const fn actuator(name: &'static str, unit: &'static str) -> Channel {
    let half = PULSE_STEPS as f32 / 2.0;
    sensor(name, unit, half, 1.0 / half)
}

type AnalogPin<I> = AdcPin<Pin<I, FunctionNull, PullNone>>;

/// The chip's parts that the policy uses.
pub struct Board {
    timer: Timer<CopyableTimer0>,
    watchdog: Watchdog,
    converter: Adc,
    analog: (AnalogPin<Gpio26>, AnalogPin<Gpio27>, AnalogPin<Gpio28>),
    pulses: (
        Slice<Pwm0, FreeRunning>,
        Slice<Pwm1, FreeRunning>,
        Slice<Pwm2, FreeRunning>,
    ),
    permit: Pin<Gpio14, FunctionSioInput, PullUp>,
    enable: Pin<Gpio15, FunctionSioOutput, PullDown>,
}

impl Board {
    /// Starts clocks and pins, with every actuator safe. `None` if the crystal or a pin does not work.
    pub fn start() -> Option<Board> {
        let mut device = pac::Peripherals::take()?;
        let mut watchdog = Watchdog::new(device.WATCHDOG);
        let clocks = init_clocks_and_plls(
            CRYSTAL_HZ,
            device.XOSC,
            device.CLOCKS,
            device.PLL_SYS,
            device.PLL_USB,
            &mut device.RESETS,
            &mut watchdog,
        )
        .ok()?;
        let sio = Sio::new(device.SIO);
        let pins = Pins::new(
            device.IO_BANK0,
            device.PADS_BANK0,
            sio.gpio_bank0,
            &mut device.RESETS,
        );
        let enable = pins.gpio15.into_push_pull_output_in_state(PinState::Low);
        let slices = Slices::new(device.PWM, &mut device.RESETS);
        let mut pulses = (slices.pwm0, slices.pwm1, slices.pwm2);
        macro_rules! start {
            ($slice:expr, $pin:expr) => {
                $slice.set_top(PULSE_STEPS - 1);
                let _ = $slice.channel_a.set_duty_cycle(PULSE_STEPS / 2);
                $slice.channel_a.output_to($pin);
                $slice.enable();
            };
        }
        start!(pulses.0, pins.gpio0);
        start!(pulses.1, pins.gpio2);
        start!(pulses.2, pins.gpio4);
        Some(Board {
            timer: Timer::new_timer0(device.TIMER0, &mut device.RESETS, &clocks),
            watchdog,
            converter: Adc::new(device.ADC, &mut device.RESETS),
            analog: (
                AdcPin::new(pins.gpio26.reconfigure()).ok()?,
                AdcPin::new(pins.gpio27.reconfigure()).ok()?,
                AdcPin::new(pins.gpio28.reconfigure()).ok()?,
            ),
            pulses,
            permit: pins.gpio14.into_pull_up_input(),
            enable,
        })
    }

    /// Lets the watchdog restart the chip if it is not fed for this time, at most 8.3 s.
    pub fn start_watchdog(&mut self, timeout_us: u32) {
        self.watchdog.start(timeout_us.micros());
    }

    fn write(&mut self, [first, second, third]: [u16; ACTUATORS.len()]) {
        let _ = self.pulses.0.channel_a.set_duty_cycle(first);
        let _ = self.pulses.1.channel_a.set_duty_cycle(second);
        let _ = self.pulses.2.channel_a.set_duty_cycle(third);
    }
}

impl Plant for Board {
    fn now_us(&mut self) -> u64 {
        self.timer.get_counter().ticks()
    }

    fn feed_watchdog(&mut self) {
        self.watchdog.feed();
    }

    fn sense(&mut self, observation: &mut [f32]) -> bool {
        let (first, second, third) = &mut self.analog;
        macro_rules! read {
            ($pin:expr) => {
                self.converter.read($pin).ok().filter(|_| converted())
            };
        }
        let steps = [read!(first), read!(second), read!(third)];
        for ((value, sensor), step) in observation.iter_mut().zip(&SENSORS).zip(steps) {
            // Without a step the element is missing.
            *value = step.map_or(f32::NAN, |step| sensor.value(step));
        }
        for (index, value) in observation.iter_mut().enumerate().skip(steps.len()) {
            *value = read_other(index);
        }
        self.permit.is_low() == Ok(true)
    }

    fn act(&mut self, action: Action<'_>) -> bool {
        // edit 7: a policy of discrete tasks gives `Action::Discrete`, the index of an action.
        let Action::Continuous(values) = action else {
            return false;
        };
        let mut steps = [PULSE_STEPS / 2; ACTUATORS.len()];
        for ((step, value), actuator) in steps.iter_mut().zip(values).zip(&ACTUATORS) {
            *step = actuator.step(*value, PULSE_STEPS);
        }
        self.write(steps);
        self.enable.set_high().is_ok()
    }

    fn make_safe(&mut self) {
        // These pins cannot fail: the error has no values.
        let _ = self.enable.set_low();
        self.write(ACTUATORS.map(|actuator| actuator.step(0.0, PULSE_STEPS)));
    }
}

/// Whether the last conversion was free of errors, which this release of the vendor's crate does not say.
fn converted() -> bool {
    // SAFETY: The register of the converter is only read.
    let converter = unsafe { &*pac::ADC::ptr() };
    converter.cs().read().err().bit_is_clear()
}

/// edit 8: reads the input with this index, in the policy's unit: an encoder or an inertial sensor, for example. NaN says
/// that there is no value now.
fn read_other(index: usize) -> f32 {
    core::hint::black_box(index);
    f32::NAN
}
