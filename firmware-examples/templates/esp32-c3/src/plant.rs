//! The pins of an ESP32-C3: which sensor is which input, which output drives what, and what is safe.
//!
//! | pin | what |
//! |---|---|
//! | GPIO0, GPIO1, GPIO3 | the first three sensors, 0 to 2.5 V |
//! | GPIO4, GPIO5, GPIO6 | the actuators: pulses of 20 kHz, half on for 0, as a bridge in locked antiphase takes them |
//! | GPIO7 | to ground: the policy may drive; open: it may not |
//! | GPIO10 | high while the policy drives: the enable input of the motor drivers. A resistor holds it low while the chip starts. |

use embedded_hal::pwm::SetDutyCycle as _;
use esp_hal::Blocking;
use esp_hal::analog::adc::{Adc, AdcConfig, AdcPin, Attenuation};
use esp_hal::clock::CpuClock;
use esp_hal::gpio::{DriveMode, Input, InputConfig, Level, Output, OutputConfig, Pin as _, Pull};
use esp_hal::ledc::channel::{self, Channel as Pulse, ChannelIFace as _};
use esp_hal::ledc::timer::{self, TimerIFace as _};
use esp_hal::ledc::{LSGlobalClkSource, Ledc, LowSpeed};
use esp_hal::peripherals::{ADC1, GPIO0, GPIO1, GPIO3, TIMG0};
use esp_hal::time::{Duration, Instant, Rate};
use esp_hal::timer::timg::{MwdtStage, TimerGroup, Wdt};
use static_cell::StaticCell;
use tpg_board::control::{Channel, Plant};
use tpg_runtime::Action;

/// Steps of a pulse.
const PULSE_STEPS: u16 = 1 << 11;
const PULSE_BITS: timer::config::Duty = timer::config::Duty::Duty11Bit;

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

type AnalogPin<P> = AdcPin<P, ADC1<'static>>;

/// The chip's parts that the policy uses.
pub struct Board {
    watchdog: Wdt<TIMG0<'static>>,
    converter: Adc<'static, ADC1<'static>, Blocking>,
    analog: (
        AnalogPin<GPIO0<'static>>,
        AnalogPin<GPIO1<'static>>,
        AnalogPin<GPIO3<'static>>,
    ),
    pulses: [Pulse<'static, LowSpeed>; ACTUATORS.len()],
    permit: Input<'static>,
    enable: Output<'static>,
}

impl Board {
    /// Starts clocks and pins, with every actuator safe. `None` if it was called before or a clock does not fit the pulses.
    pub fn start() -> Option<Board> {
        static PULSE_TIMER: StaticCell<timer::Timer<'static, LowSpeed>> = StaticCell::new();

        let device = esp_hal::init(esp_hal::Config::default().with_cpu_clock(CpuClock::_160MHz));
        let enable = Output::new(device.GPIO10, Level::Low, OutputConfig::default());
        let mut pulses = Ledc::new(device.LEDC);
        pulses.set_global_slow_clock(LSGlobalClkSource::APBClk);
        let mut timer = pulses.timer::<LowSpeed>(timer::Number::Timer0);
        timer
            .configure(timer::config::Config {
                duty: PULSE_BITS,
                clock_source: timer::LSClockSource::APBClk,
                frequency: Rate::from_khz(20),
            })
            .ok()?;
        let timer: &'static _ = PULSE_TIMER.try_init(timer)?;
        let start = |number, pin| {
            let mut pulse = Pulse::new(number, pin);
            pulse
                .configure(channel::config::Config {
                    timer,
                    duty_pct: 50,
                    drive_mode: DriveMode::PushPull,
                })
                .ok()
                .map(|()| pulse)
        };
        let mut analog = AdcConfig::new();
        Some(Board {
            watchdog: TimerGroup::new(device.TIMG0).wdt,
            analog: (
                analog.enable_pin(device.GPIO0, Attenuation::_11dB),
                analog.enable_pin(device.GPIO1, Attenuation::_11dB),
                analog.enable_pin(device.GPIO3, Attenuation::_11dB),
            ),
            converter: Adc::new(device.ADC1, analog),
            pulses: [
                start(channel::Number::Channel0, device.GPIO4.degrade())?,
                start(channel::Number::Channel1, device.GPIO5.degrade())?,
                start(channel::Number::Channel2, device.GPIO6.degrade())?,
            ],
            permit: Input::new(device.GPIO7, InputConfig::default().with_pull(Pull::Up)),
            enable,
        })
    }

    /// Lets the watchdog restart the chip if it is not fed for this time.
    pub fn start_watchdog(&mut self, timeout_us: u32) {
        let timeout = Duration::from_micros(timeout_us.into());
        self.watchdog.set_timeout(MwdtStage::Stage0, timeout);
        self.watchdog.enable();
    }

    fn write(&mut self, steps: [u16; ACTUATORS.len()]) {
        for (pulse, step) in self.pulses.iter_mut().zip(steps) {
            // Steps are in range, so there is no error.
            let _ = pulse.set_duty_cycle(step);
        }
    }
}

impl Plant for Board {
    fn now_us(&mut self) -> u64 {
        Instant::now().duration_since_epoch().as_micros()
    }

    fn feed_watchdog(&mut self) {
        self.watchdog.feed();
    }

    fn sense(&mut self, observation: &mut [f32]) -> bool {
        let (first, second, third) = &mut self.analog;
        // A conversion takes some ten microseconds. The only error is that it has not ended.
        macro_rules! read {
            ($pin:expr) => {
                loop {
                    if let Ok(step) = self.converter.read_oneshot($pin) {
                        break step;
                    }
                }
            };
        }
        let steps = [read!(first), read!(second), read!(third)];
        for ((value, sensor), step) in observation.iter_mut().zip(&SENSORS).zip(steps) {
            *value = sensor.value(step);
        }
        for (index, value) in observation.iter_mut().enumerate().skip(steps.len()) {
            *value = read_other(index);
        }
        self.permit.is_low()
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
        self.enable.set_high();
        true
    }

    fn make_safe(&mut self) {
        self.enable.set_low();
        self.write(ACTUATORS.map(|actuator| actuator.step(0.0, PULSE_STEPS)));
    }
}

/// edit 8: reads the input with this index, in the policy's unit: an encoder or an inertial sensor, for example. NaN says
/// that there is no value now.
fn read_other(index: usize) -> f32 {
    core::hint::black_box(index);
    f32::NAN
}
