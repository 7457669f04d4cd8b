//! A calibration of three axes whose interferometer loses count while a line is read.

use machine::records::read_journal;
use mock_bus::fault::{Fault, FaultConfig, FaultId};
use tests::in_every_run;
use tests::volume::{Volume, quick};
use truestage::Failure;
use truestage::emulated::Emulated;
use truestage::volumetric::VolumeLog;
use truestage::volumetric::{LineOperator, LineTask, VolumetricFailure, WarmUp};

/// Some micrometres: more than these errors are known to, less than a machine of this size has.
const HALF_WAVELENGTHS: i64 = 30;
/// After the line was set up; the drive to its begin is over by then, and half of it is not read.
const READING_S: f64 = 3.0;

/// Sets lines up; while one of them is read the counter slips.
struct Careless {
    emulated: Emulated,
    /// Which one, counted from 1.
    slips_on: usize,
    asked: usize,
    /// All lines that were asked for.
    all: Vec<usize>,
    slip: Option<FaultId>,
}

impl LineOperator for Careless {
    fn ask_line(&mut self, task: &LineTask) -> Result<(), Failure> {
        self.asked = task.step.0;
        self.all.push(task.step.0);
        self.emulated.ask_line(task)
    }

    fn is_set_up(&mut self) -> Result<bool, Failure> {
        let is_set_up = self.emulated.is_set_up()?;
        if is_set_up && self.asked == self.slips_on && self.slip.is_none() {
            let mut slip = FaultConfig::permanent(Fault::FringeJump {
                half_wavelengths: HALF_WAVELENGTHS,
            });
            slip.from_s = READING_S;
            let slip = self.emulated.simulation_mut().inject(slip);
            self.slip = Some(slip.expect("the machine has an interferometer"));
        }
        Ok(is_set_up)
    }

    fn pack_up(&mut self) -> Result<(), Failure> {
        self.emulated.pack_up()
    }
}

/// Lines along an axis, across it, and a diagonal of the body.
#[test]
fn a_count_that_slips_is_stored_nowhere_and_its_line_is_named_and_read_again_alone() {
    for slips_on in in_every_run(vec![17], vec![2, 17, 20]) {
        let mut volume = Volume::zeroed(1, quick, |text| text);
        let store = volume.bench.store.clone();
        let mut hand = Careless {
            emulated: volume.bench.emulated.clone(),
            slips_on,
            asked: 0,
            all: Vec::new(),
            slip: None,
        };
        let machine = &mut volume.bench.machine;
        let refused =
            machine
                .volumetric()
                .unwrap()
                .calibrate(&store, WarmUp::None, None, &mut hand);
        let slip = hand.slip.expect("the line was asked for");
        let struck = hand.emulated.simulation().fault_deliveries(slip);
        assert_eq!(struck, 1, "line {slips_on}");
        let failure = match refused {
            Ok(made) => panic!("line {slips_on}: stored as {}", made.id),
            Err(failure) => failure,
        };
        let text = failure.to_string();
        let scattered = matches!(failure.of_kind(), Some(VolumetricFailure::Scatter(_)));
        assert!(scattered, "line {slips_on}: {text}");
        assert_eq!(failure.exit_code(), 5);
        assert!(
            text.contains(&format!("line {slips_on} ("))
                && text.contains(") slipped: from reading"),
            "{slips_on}: {text}"
        );
        assert!(
            text.contains(&format!("measure line {slips_on} again")),
            "{slips_on}: {text}"
        );
        assert!(store.list().expect("it can be read").is_empty());
        let known = machine.volumetric().unwrap().state(&store);
        let known = known.unwrap_or_else(|failure| panic!("{failure}"));
        assert!(known.is_none(), "it is in use");
        let journal = store.newest_run("calibrate", "volume");
        let journal = journal.expect("it can be read").expect("there is one");
        let read = read_journal::<VolumeLog>(&journal).unwrap_or_else(|error| panic!("{error}"));
        assert!(read.failure.is_some() && !read.complete);
        let asked = hand.all.len();
        let mut volumetric = machine.volumetric().unwrap();
        let made = volumetric.calibrate(&store, WarmUp::None, Some(&journal), &mut hand);
        let made = made.unwrap_or_else(|failure| panic!("line {slips_on}: {failure}"));
        assert_eq!(hand.all[asked..], [slips_on]);
        assert_eq!(made.lines, read.log.plan.expect("it has one").lines.len());
    }
}
